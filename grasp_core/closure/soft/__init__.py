"""Are contacts with torsional friction in force closure, and from which friction on?

Contacts whose fingertips transmit a torque about the normal come in as `SoftContacts`. Answers with
forces, torques or a twist that prove them go out. Contacts without torsion never come here.
"""
