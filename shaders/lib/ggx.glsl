// Glossy reflection. Twin: glbump/reference/ggx.py.

// Split-sum factors (A, B) of GGX with Schlick's Fresnel: reflected share = F0 A + B. The analytic fit of
// Karis, "Physically Based Shading on Mobile", 2014. Error against quadrature with height-correlated Smith
// shadowing, n_dot_v and roughness in 0.05..1: A at most 0.37, B at most 0.09 (at grazing angles).
vec2 dfg_fit(float n_dot_v, float roughness) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a004 = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return vec2(-1.04, 1.04) * a004 + r.zw;
}

// Share of the light that a glossy surface reflects, light scattered more than once between its facets
// counted in: (F0 A + B) / (A + B), so F0 = 1 reflects all of it, at every angle and roughness, and most of the
// fit's error cancels: glossy_share at most 0.09 in the same domain, 0.02 rms.
vec3 glossy_share(vec3 f0, float n_dot_v, float roughness) {
    // The fit dips below 0: B where it is rough, A at grazing angles where it is smooth; the share would pass 1.
    vec2 dfg = max(dfg_fit(clamp(n_dot_v, 0.0, 1.0), roughness), vec2(0.0));
    return (f0 * dfg.x + dfg.y) / (dfg.x + dfg.y);
}

// Direction to look up a chain that was blurred for n = v = r: off the mirror direction towards the normal, as the
// peak of a broad lobe is, because what lies below the horizon is cut off. After Lagarde and de Rousiers, "Moving
// Frostbite to Physically Based Rendering", 2014, section 4.9.3. Not unit length; n and mirror_dir are.
vec3 lobe_dir(vec3 n, vec3 mirror_dir, float roughness) {
    float alpha = roughness * roughness;
    float smoothness = 1.0 - alpha;
    return mix(n, mirror_dir, smoothness * (sqrt(smoothness) + alpha));
}
