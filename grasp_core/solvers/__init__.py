"""What is the optimum of a program, and how is the answer checked?

Linear, quadratic, conic and nearest-point programs come in as arrays. Answers go out that plain
arithmetic has checked; `ties` decides between equal optima.
"""
