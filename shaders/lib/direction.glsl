// Directions of any length, made fit for arithmetic. Twin: glbump/reference/direction.py.

const vec3 MOST = vec3(3.40282347e38);

// The largest component's size: the length in cubes.
float largest_part(vec3 dir) {
    vec3 a = abs(dir);
    return max(a.x, max(a.y, a.z));
}

// dir at another length: no product of a few of its components overflows, and the largest can be divided by (GLSL
// promises nothing of a reciprocal that is no normal float). Infinity counts as the largest float. What is shorter
// than 2e-23, where drivers that flush denormals begin to turn it, counts as none, and none as up.
vec3 finite_dir(vec3 dir) {
    vec3 d = clamp(dir, -MOST, MOST) / 16777216.0;
    return largest_part(d) < 1e-30 ? vec3(0.0, 1.0, 0.0) : d;
}

vec3 unit_dir(vec3 dir) {
    vec3 d = finite_dir(dir);
    return normalize(d / largest_part(d));
}

// How unit_dir(dir) changes where dir changes by `change`: across it, in radians. At most some 1e18.
vec3 turning(vec3 dir, vec3 change) {
    vec3 d = finite_dir(dir);
    float largest = largest_part(d);
    d /= largest;
    vec3 c = clamp(clamp(change, -MOST, MOST) / 16777216.0 / largest, -1e18, 1e18);
    return (c - d * (dot(c, d) / dot(d, d))) / length(d);
}

// Two unit vectors across the unit vector n and each other (Duff et al., "Building an orthonormal basis, revisited",
// 2017).
void axes_across(vec3 n, out vec3 x, out vec3 y) {
    float side = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (side + n.z);
    float b = n.x * n.y * a;
    x = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    y = vec3(b, side + n.y * n.y * a, -n.y);
}

// What lies below the horizon, mirrored above it.
vec3 turned_up(vec3 dir) {
    return vec3(dir.x, abs(dir.y), dir.z);
}
