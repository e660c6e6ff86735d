// How what a ray meets changes from pixel to pixel: ray differentials (Igehy, "Tracing Ray Differentials", 1999).
// Twin: glbump/reference/footprint.py. Each is the derivative of the function that its name begins with.

#include "direction.glsl"
#include "reflect.glsl"

// Least cosine of rays to a surface that they pass or leave: there changes are without bound.
const float LEAST_COSINE = 1e-5;

// Change of the point where a ray along dir meets a surface with normal n, where at the same depth it changes by dp:
// moved along the ray into the tangent plane (equations 10 to 12). Of n only the direction counts. least: the cosine of
// incidence that counts at least; at an outline points run along the surface without bound.
vec3 hit_change(vec3 dp, vec3 dir, vec3 n, float least) {
    float along = dot(dir, n);
    float shortest = least * length(n);
    along = along < 0.0 ? min(along, -shortest) : max(along, shortest);
    return dp - dir * (dot(dp, n) / along);
}

// Of torus_normal, where a point p_object of the torus changes by dp, along it: it turns with the circle about the axis
// as far as it leans outwards, and with the tube.
vec3 torus_normal_change(vec3 p_object, vec3 dp, float radius) {
    float h = length(p_object.xz);
    vec2 out_dir = p_object.xz / max(h, 1e-30);
    vec3 parallel = vec3(out_dir.y, 0.0, -out_dir.x);
    vec2 ring = vec2(h - radius, p_object.y);
    float round_axis = dot(dp, parallel);
    return (dp - round_axis * parallel) / max(length(ring), 1e-30)
         + parallel * (round_axis * ring.x / max(length(ring), 1e-30) / max(h, 1e-30));
}

// Changes of u and v, where a point changes by dp: what of dp lies along the surface, in its derivatives. Where u
// and v have no area, 0.
vec2 uv_change(vec3 dp, vec3 dpdu, vec3 dpdv) {
    float uu = dot(dpdu, dpdu);
    float uv = dot(dpdu, dpdv);
    float vv = dot(dpdv, dpdv);
    float u = dot(dp, dpdu);
    float v = dot(dp, dpdv);
    return vec2(u * vv - v * uv, v * uu - u * uv) / max(uu * vv - uv * uv, 1e-30);
}

// Of bump_normal, for changes of the surface's normal and of the gradient.
vec3 bump_normal_change(vec3 n, vec3 gradient, vec3 dn, vec3 dgradient) {
    return turning(n - gradient, dn - dgradient);
}

// Of reflect_dir (equation 14).
vec3 reflect_dir_change(vec3 dir, vec3 n, vec3 ddir, vec3 dn) {
    return ddir - 2.0 * (dot(dir, n) * dn + (dot(ddir, n) + dot(dir, dn)) * n);
}

// Of refract_dir (equations 15 to 18), and of the mirror direction where it gives that.
vec3 refract_dir_change(vec3 dir, vec3 n, float eta, vec3 ddir, vec3 dn) {
    float along = dot(dir, n);
    vec3 across = eta * (dir - along * n);
    float rest = 1.0 - dot(across, across);
    if (rest < 0.0) return reflect_dir_change(dir, n, ddir, dn);
    float change = dot(ddir, n) + dot(dir, dn);
    float behind = max(sqrt(rest), LEAST_COSINE);
    float mu = along > 0.0 ? behind - eta * along : -behind - eta * along;
    float dmu = (along > 0.0 ? eta * along / behind - 1.0 : -eta * along / behind - 1.0) * eta * change;
    return eta * ddir + mu * dn + dmu * n;
}
