// Surfaces to texture coordinates: the exact point under a ray, its u,v and its partial derivatives.
// Twin: glbump/reference/mapping.py. Parametrisations: README, "Conventions".

const float PI = 3.14159265358979323846;

// Ray parameter from `p_object`, a point on the ray near the sphere, to where the ray enters it; where it passes
// outside, to its closest point. dir_object: unit length. With p near the sphere nothing large cancels, at any
// distance of the eye: the error is some 2e-7 of the radius, divided by the cosine of incidence.
float sphere_step(vec3 p_object, vec3 dir_object, float radius) {
    float b = dot(p_object, dir_object);
    float c = dot(p_object, p_object) - radius * radius;
    return -b - sqrt(max(b * b - c, 0.0));
}

// On the axis u is 1/2: GLSL leaves atan(0, 0) undefined, and drivers differ.
vec2 sphere_uv(vec3 p_object) {
    float z = p_object.x == 0.0 && p_object.z == 0.0 ? 1.0 : p_object.z;
    return vec2(0.5 + atan(p_object.x, z) / (2.0 * PI),
                0.5 + atan(p_object.y, length(p_object.xz)) / PI);
}

vec3 sphere_dpdu(vec3 p_object) {
    return 2.0 * PI * vec3(p_object.z, 0.0, -p_object.x);
}

// At the poles u is 1/2 by rule, so dp/dv there lies along -+z.
vec3 sphere_dpdv(vec3 p_object) {
    float h = length(p_object.xz);
    vec2 out_dir = h > 0.0 ? p_object.xz / h : vec2(0.0, 1.0);
    return PI * vec3(-p_object.y * out_dir.x, h, -p_object.y * out_dir.y);
}

// Of the unit normal, the same each way.
vec3 sphere_dndu(vec3 p_object, float radius) {
    return sphere_dpdu(p_object) / radius;
}

vec3 sphere_dndv(vec3 p_object, float radius) {
    return sphere_dpdv(p_object) / radius;
}

// Ray parameter from `p_object`, a point on the ray near the torus, to the torus: Newton's iteration on
// (hypot(x,z) - radius)^2 + y^2 = tube^2. A step is never longer than a tenth of the tube, so a ray that
// passes just outside stays near.
float torus_step(vec3 p_object, vec3 dir_object, float radius, float tube) {
    float t = 0.0;
    for (int i = 0; i < 3; ++i) {
        vec3 p = p_object + t * dir_object;
        float h = length(p.xz);
        float f = (h - radius) * (h - radius) + p.y * p.y - tube * tube;
        float slope = 2.0 * ((h - radius) * dot(p.xz, dir_object.xz) / max(h, 1e-30) + p.y * dir_object.y);
        float bound = 0.1 * tube;
        t -= clamp(f / (abs(slope) > 1e-20 ? slope : 1e-20), -bound, bound);
    }
    return t;
}

// The outward normal of the torus at, or near, its surface; unit length.
vec3 torus_normal(vec3 p_object, float radius) {
    float h = length(p_object.xz);
    vec2 out_dir = h > 0.0 ? p_object.xz / h : vec2(0.0, 1.0);
    vec2 ring = vec2(h - radius, p_object.y);
    vec2 tube_dir = ring / max(length(ring), 1e-30);
    return vec3(out_dir.x * tube_dir.x, tube_dir.y, out_dir.y * tube_dir.x);
}

vec2 torus_uv(vec3 p_object, float radius) {
    float z = p_object.x == 0.0 && p_object.z == 0.0 ? 1.0 : p_object.z;
    return vec2(0.5 + atan(p_object.x, z) / (2.0 * PI),
                0.5 + atan(p_object.y, length(p_object.xz) - radius) / (2.0 * PI));
}

vec3 torus_dpdu(vec3 p_object) {
    return 2.0 * PI * vec3(p_object.z, 0.0, -p_object.x);
}

vec3 torus_dpdv(vec3 p_object, float radius) {
    float h = length(p_object.xz);
    vec2 out_dir = h > 0.0 ? p_object.xz / h : vec2(0.0, 1.0);
    return 2.0 * PI * vec3(-p_object.y * out_dir.x, h - radius, -p_object.y * out_dir.y);
}

// Of the unit normal: about the axis it turns as the point does, but is only as long as it leans outwards; about the
// tube it turns as on a circle of radius 1.
vec3 torus_dndu(vec3 p_object, float radius) {
    float h = length(p_object.xz);
    vec2 ring = vec2(h - radius, p_object.y);
    return torus_dpdu(p_object) * (ring.x / max(length(ring), 1e-30) / max(h, 1e-30));
}

vec3 torus_dndv(vec3 p_object, float radius) {
    vec2 ring = vec2(length(p_object.xz) - radius, p_object.y);
    return torus_dpdv(p_object, radius) / max(length(ring), 1e-30);
}

// u,v of `p_object` in the flat convex quad a b c d with uv (0,0) (1,0) (1,1) (0,1): the lecture's inverse
// bilinear mapping. With p = a + u e + v f + u v g, crossing with the quad's normal N leaves a quadratic in v:
//   N.(g x f) v^2 + (N.(e x f) + N.(g x h)) v + N.(e x h) = 0,  h = a - p,
// solved in the form without cancellation (Numerical Recipes 5.6), which is also right for g = 0.
vec2 inverse_bilinear(vec3 p_object, vec3 a, vec3 b, vec3 c, vec3 d) {
    vec3 e = b - a;
    vec3 f = d - a;
    vec3 g = (a - b) + (c - d);
    vec3 h = a - p_object;
    vec3 n = cross(c - a, d - b);
    float k2 = dot(n, cross(g, f));
    float k1 = dot(n, cross(e, f)) + dot(n, cross(g, h));
    float k0 = dot(n, cross(e, h));
    float root = sqrt(max(k1 * k1 - 4.0 * k2 * k0, 0.0));
    // k1 >= 0 everywhere in a convex quad (it is 0 only where two edges meet at infinity).
    float v = -2.0 * k0 / (k1 + root);
    // u from p + h... : u (e + v g) = -(h + v f), along the longer component.
    vec3 along = e + v * g;
    float u = -dot(h + v * f, along) / dot(along, along);
    return vec2(u, v);
}

vec3 bilinear_dpdu(vec2 uv, vec3 a, vec3 b, vec3 c, vec3 d) {
    return mix(b - a, c - d, uv.y);
}

vec3 bilinear_dpdv(vec2 uv, vec3 a, vec3 b, vec3 c, vec3 d) {
    return mix(d - a, c - b, uv.x);
}

// Barycentric weights of a, b, c at `p_object` in the plane of the triangle; their sum is 1.
// A triangle without area gives (1, 0, 0).
vec3 barycentric(vec3 p_object, vec3 a, vec3 b, vec3 c) {
    vec3 n = cross(b - a, c - a);
    float area = dot(n, n);
    if (area == 0.0) return vec3(1.0, 0.0, 0.0);
    float wb = dot(n, cross(p_object - a, c - a)) / area;
    float wc = dot(n, cross(b - a, p_object - a)) / area;
    return vec3(1.0 - wb - wc, wb, wc);
}
