// Directions of any length, made fit for arithmetic. Twin: glbump/reference/direction.py.

// dir at another length: no product of a few of its components overflows, and the largest can be divided by (GLSL
// promises nothing of a reciprocal that is no normal float). Infinity counts as the largest float. What is shorter
// than 2e-23, where drivers that flush denormals begin to turn it, counts as none, and none as up.
vec3 finite_dir(vec3 dir) {
    const vec3 LARGEST = vec3(3.40282347e38);
    vec3 d = clamp(dir, -LARGEST, LARGEST) / 16777216.0;
    vec3 a = abs(d);
    return max(a.x, max(a.y, a.z)) < 1e-30 ? vec3(0.0, 1.0, 0.0) : d;
}

vec3 unit_dir(vec3 dir) {
    vec3 d = finite_dir(dir);
    vec3 a = abs(d);
    return normalize(d / max(a.x, max(a.y, a.z)));
}

// What lies below the horizon, mirrored above it.
vec3 turned_up(vec3 dir) {
    return vec3(dir.x, abs(dir.y), dir.z);
}
