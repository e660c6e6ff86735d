// Glossy reflection. Twin: glbump/reference/ggx.py.

const float TURN = 6.28318530717958647693;
const float GOLDEN = 0.61803398874989484820;  // the golden ratio less 1

// Split-sum factors (A, B) of GGX with Schlick's Fresnel: share reflected once = F0 A + B. The analytic fit of
// Karis, "Physically Based Shading on Mobile", 2014. Error against quadrature with height-correlated Smith
// shadowing, n_dot_v and roughness in 0.05..1: A at most 0.37, B at most 0.09 (at grazing angles).
vec2 dfg_fit(float n_dot_v, float roughness) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float x = clamp(n_dot_v, 0.0, 1.0);
    float a004 = min(r.x * r.x, exp2(-9.28 * x)) * r.x + r.y;
    // The fit dips below 0: B where it is rough, A at grazing angles where it is smooth.
    return max(vec2(-1.04, 1.04) * a004 + r.zw, 0.0);
}

// Where a table of the factors has them, `size` texels wide and high: columns by the root of n_dot_v, since they bend
// most at grazing angles, rows by roughness, both from 0 to 1 at the texels' middles.
vec2 dfg_place(float n_dot_v, float roughness, float size) {
    return (vec2(sqrt(clamp(n_dot_v, 0.0, 1.0)), roughness) * (size - 1.0) + 0.5) / size;
}

// Share of the light that a glossy surface reflects, light scattered more than once between its facets counted in.
// f0 reflects F = (F0 A + B) / (A + B) of what meets a facet, A + B leaves after one, and the rest meets a second:
// F ((A + B) + F (1 - (A + B))), which for F0 = 1 is 1 at every angle and roughness. Turquin, "Practical multiple
// scattering compensation for microfacet models", 2019, equation 16, with F in place of F0: against random walks on
// Smith's surface (Heitz et al. 2016) at most 0.056 off, 0.016 rms. With dfg_fit's factors, against quadrature's:
// glossy_share at most 0.12.
vec3 glossy_share(vec3 f0, vec2 dfg) {
    float once = dfg.x + dfg.y;
    vec3 facet = (f0 * dfg.x + dfg.y) / once;
    return facet * mix(facet, vec3(1.0), min(once, 1.0));
}

// Direction to look up a chain that was blurred for n = v = r: off the mirror direction towards the normal, as the
// peak of a broad lobe is, because what lies below the horizon is cut off. After Lagarde and de Rousiers, "Moving
// Frostbite to Physically Based Rendering", 2014, section 4.9.3. Not unit length; n and mirror_dir are.
vec3 lobe_dir(vec3 n, vec3 mirror_dir, float roughness) {
    float alpha = roughness * roughness;
    float smoothness = 1.0 - alpha;
    return mix(n, mirror_dir, smoothness * (sqrt(smoothness) + alpha));
}

// The lobe D(h) (n.l) of n = v, over its peak, of the cosine between n and l.
float lobe_shape(float cosine, float alpha) {
    float square = alpha * alpha;
    float fall = square / (square + 0.5 * (1.0 - square) * (1.0 - cosine));
    return max(cosine, 0.0) * fall * fall;
}

// Place number i of `count` that cover the unit square evenly: golden-ratio steps along x, layers along y (Fibonacci's
// spiral, where x is an angle and y a height).
vec2 lobe_place(int i, int count) {
    return vec2(fract(float(i) * GOLDEN), (float(i) + 0.5) / float(count));
}

// A facet's normal as v_tan sees them (z along the surface's normal): evenly over the visible ones for even places.
// GGX; Dupuy and Benyoub, "Sampling visible GGX normals with spherical caps", 2023 (the same distribution as Heitz
// 2018). Unit length; alpha from 1e-6.
vec3 visible_normal(vec3 v_tan, float alpha, vec2 place) {
    vec3 v = normalize(vec3(alpha * v_tan.xy, v_tan.z));
    float z = (1.0 - place.y) * (1.0 + v.z) - v.z;
    float across = sqrt(max(1.0 - z * z, 0.0));
    vec3 h = vec3(across * cos(TURN * place.x), across * sin(TURN * place.x), z) + v;
    return normalize(vec3(alpha * h.xy, max(h.z, 0.0)));
}

// Solid angle round h_tan of one of `count` visible normals: 1 / (count G1(v) (v.h) D(h) / (n.v)). D in Lagrange's
// form, |n x h|^2 + (alpha n.h)^2, which does not cancel.
float normal_angle(vec3 h_tan, vec3 v_tan, float alpha, float count) {
    float tail = dot(h_tan.xy, h_tan.xy) / alpha + alpha * h_tan.z * h_tan.z;
    float slant = sqrt(alpha * alpha + (1.0 - alpha * alpha) * v_tan.z * v_tan.z);
    return 0.25 * TURN * tail * tail * (v_tan.z + slant) / (max(dot(v_tan, h_tan), 1e-6) * count);
}

// Share of what leaves a visible facet that no other facet stops: Smith's G2 / G1, correlated in height. 0 for
// directions below the surface.
float unshadowed(float n_dot_v, float n_dot_l, float alpha) {
    float square = alpha * alpha;
    float slant_v = sqrt(square + (1.0 - square) * n_dot_v * n_dot_v);
    float slant_l = sqrt(square + (1.0 - square) * n_dot_l * n_dot_l);
    float l = max(n_dot_l, 0.0);
    return l * (n_dot_v + slant_v) / max(l * slant_v + n_dot_v * slant_l, 1e-30);
}
