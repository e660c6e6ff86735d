// Reflection and what share of the light it takes. Twin: glbump/reference/reflect.py.

// Mirror direction of dir, which points at the surface. Unit for unit input.
vec3 reflect_dir(vec3 dir, vec3 n) {
    return dir - 2.0 * dot(dir, n) * n;
}

// Reflectance at normal incidence of a dielectric in air (Fresnel).
float f0_from_ior(float ior) {
    float r = (ior - 1.0) / (ior + 1.0);
    return r * r;
}

// Schlick 1994, equation 15: F0 + (1 - F0)(1 - cos)^5. cos_theta outside 0..1 is taken as its nearer end.
vec3 fresnel_schlick(vec3 f0, float cos_theta) {
    float m = clamp(1.0 - cos_theta, 0.0, 1.0);
    float m2 = m * m;
    return f0 + (1.0 - f0) * (m2 * m2 * m);
}

// Direction of dir behind the surface (Snell, in vector form): its part along the surface becomes eta times as long,
// eta being the index of refraction before the surface over that behind it. Total internal reflection gives the mirror direction. Unit for unit input; n may
// point to either side, and eta = 1 gives dir.
vec3 refract_dir(vec3 dir, vec3 n, float eta) {
    float along = dot(dir, n);
    vec3 across = eta * (dir - along * n);
    float rest = 1.0 - dot(across, across);
    if (rest < 0.0) return reflect_dir(dir, n);
    return across + (along > 0.0 ? sqrt(rest) : -sqrt(rest)) * n;
}

// Share of unpolarised light that a dielectric reflects (Fresnel); eta as above, any above 0.
// The amplitudes' differences are multiplied out, so nothing cancels: at eta = 1 it is 0 to the last degree of grazing.
// cos_i outside 0..1 is taken as its nearer end; 1 past the critical angle.
float fresnel_dielectric(float cos_i, float eta) {
    float c = clamp(cos_i, 0.0, 1.0);
    float a = eta * c;
    float sines = eta * (1.0 - c) * (1.0 + c);
    // Twice the same, without cancellation: for eta near 1 at grazing angles, and for any eta near the normal.
    float square = c < 0.7 ? (1.0 - eta) * (1.0 + eta) + a * a : 1.0 - eta * sines;
    if (square < 0.0) return 1.0;
    float cos_t = sqrt(square);
    // s: (a - cos_t) / (a + cos_t), where a^2 - cos_t^2 = eta^2 - 1. p: s times cos(i + t) / cos(i - t).
    float sum = max(a + cos_t, 1e-18);
    float s = (1.0 - eta) / sum * ((1.0 + eta) / sum);
    float p = s * (c * cos_t - sines) / (c * cos_t + sines);
    return min(0.5 * (s * s + p * p), 1.0);
}

// A bent normal that faces away from the eye would be seen from behind: it is mirrored to the eye's side of the plane
// that dir is normal to (Mikkelsen 2010, FixNormal). Continuous: at the edge it stays as it is. Unit for unit input.
vec3 facing(vec3 n, vec3 dir) {
    return n - 2.0 * max(dot(n, dir), 0.0) * dir;
}

// A direction that a bent normal sends under the surface would be mirrored once more by the next slope: it is mirrored
// at the surface itself, whose normal n is. Continuous at the horizon. Unit for unit input.
vec3 above_surface(vec3 dir, vec3 n) {
    return dir - 2.0 * min(dot(dir, n), 0.0) * n;
}
