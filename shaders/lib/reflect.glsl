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
