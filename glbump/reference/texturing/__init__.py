"""OpenGL's texturing as the specification allows it: for every look-up the interval of permitted values, float64.

OpenGL 4.6 core leaves room for how the level of detail is rounded and with how many bits coordinates, weights and
levels are kept (8.14.1 to 8.14.3). So there is no one right value to hold a driver against: a value is right where some
weights within the bounds produce it, which is how the conformance tests judge (VK-GL-CTS, `tcuTexLookupVerifier`).

interval.py: intervals, and precisions in bits. detail.py: levels of detail. look_up.py: values.
"""
