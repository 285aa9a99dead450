"""Which four force cones positively span all forces (the paper's P3)?

Face normals and a friction angle come in. Spanning quadruples go out, with cones around the normals
or tilted inside the friction cones.
"""
