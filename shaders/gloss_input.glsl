// A glossy lobe's light: from a chain blurred beforehand, or summed facet by facet. Glue: reads uniforms, dispatches.

#define CHAIN 0
#define SAMPLED 1
#define FIT 0
#define TABLE 1

#include "lib/ggx.glsl"

uniform float roughness;
#if DFG == TABLE
uniform sampler2D dfg_table;
#endif
#if GLOSS == CHAIN
uniform samplerCube gloss;
uniform float last_gloss_level;
#elif GLOSS == SAMPLED
uniform int lobe_samples;
uniform int pixel_samples;
#if !MULTISAMPLED
uniform int sample_number;  // among the pixel's
#endif
#else
#error "GLOSS must be CHAIN or SAMPLED"
#endif

// Split-sum factors of the lobe.
vec2 lobe_factors(float n_dot_v, float roughness) {
#if DFG == FIT
    return dfg_fit(n_dot_v, roughness);
#elif DFG == TABLE
    return textureLod(dfg_table, dfg_place(n_dot_v, roughness, float(textureSize(dfg_table, 0).x)), 0.0).rg;
#else
#error "DFG must be FIT or TABLE"
#endif
}

#if GLOSS == CHAIN
// Radiance round dir_env, as a surface of this roughness mirrors it.
vec3 blurred_radiance(vec3 dir_env, float roughness) {
    READS(1.0);
#if SHOW == SHOW_LEVEL
    shown = vec4(roughness * last_gloss_level, shown.g, 0.0, 1.0);
#endif
    vec3 radiance = textureLod(gloss, dir_env, roughness * last_gloss_level).rgb;
#if EXPOSURE
    radiance *= exposure_factor;
#endif
    return radiance;
}
#else
const float SMOOTHEST = 1e-6;  // least alpha: a lobe 2e-6 radians wide is a mirror's, and its sums stay floats

// Radiance from dir_env, averaged over a solid angle.
vec3 averaged_radiance(vec3 p_room, vec3 dir_env, float angle) {
#if PARALLAX
    dir_env = in_room(p_room, dir_env);
#endif
    vec3 x, y;
    axes_across(dir_env, x, y);
    float side = sqrt(min(angle, 4.0));
    return environment_radiance(dir_env, side * x, side * y);
}

struct LobeLight {
    vec3 mirrored;
    vec3 through;
};

// Radiance mirrored over the share mirrored, and the same of what is seen through the surface (TRANSMISSION): means over
// lobe_samples facets, even among those that the eye sees, with Fresnel's reflectance and Smith's shadows as weights.
// Twin: glbump/reference/lobe.py. v_env: towards the eye. Where no facet mirrors above the horizon: what lies at
// mirror_env; where none is seen through, at through_env.
LobeLight lobe_light(vec3 p_room, vec3 v_env, vec3 n_env, vec3 geometry_env, float roughness, vec3 f0, float eta,
                     vec3 mirror_env, vec3 through_env) {
    float alpha = max(roughness * roughness, SMOOTHEST);
    float n_dot_v = clamp(dot(n_env, v_env), 1e-4, 1.0);
    vec3 x, y;
    axes_across(n_env, x, y);
    // Places are counted from the eye's side, so that none jumps where the axes do.
    vec3 along = v_env - n_dot_v * n_env;
    if (dot(along, along) > 1e-8) {
        x = normalize(along);
        y = cross(n_env, x);
    }
    vec3 v_tan = vec3(sqrt(1.0 - n_dot_v * n_dot_v), 0.0, n_dot_v);
#if MULTISAMPLED
    int sample_number = int(4.0 * fract(gl_FragCoord.y));  // of four, each has a row of its own
#endif
    int total = lobe_samples * pixel_samples;
    vec3 mirrored = vec3(0.0), mirrored_weight = vec3(0.0);
    vec3 through = vec3(0.0);
    float through_weight = 0.0;
    for (int i = 0; i < lobe_samples; i++) {
        vec3 h_tan = visible_normal(v_tan, alpha, lobe_place(i * pixel_samples + sample_number, total));
        vec3 h_env = h_tan.x * x + h_tan.y * y + h_tan.z * n_env;
        float angle = normal_angle(h_tan, v_tan, alpha, float(total));
        float v_dot_h = dot(v_tan, h_tan);
        float n_dot_l = 2.0 * v_dot_h * h_tan.z - n_dot_v;
        if (n_dot_l > 0.0) {
            vec3 l_env = reflect_dir(-v_env, h_env);
#if BUMP
            l_env = above_surface(l_env, geometry_env);
#endif
            vec3 weight = unshadowed(n_dot_v, n_dot_l, alpha) * fresnel_schlick(f0, v_dot_h);
            mirrored += weight * averaged_radiance(p_room, l_env, 4.0 * v_dot_h * angle);
            mirrored_weight += weight;
        }
#if TRANSMISSION
        // Walter et al., "Microfacet models for refraction", 2007: the far side's shadows, and equation 17.
        vec3 t_env = refract_dir(-v_env, h_env, eta);
        float t_dot_h = -dot(t_env, h_env);
        float weight_t = unshadowed(1.0, -dot(t_env, n_env), alpha) * (1.0 - fresnel_dielectric(v_dot_h, eta));
        if (weight_t > 0.0) {
#if BUMP
            t_env = above_surface(t_env, -geometry_env);
#endif
            float narrowed = eta * v_dot_h - t_dot_h;
            through += weight_t * averaged_radiance(p_room, t_env,
                                                    narrowed * narrowed / max(abs(t_dot_h), 1e-3) * angle);
            through_weight += weight_t;
        }
#endif
    }
    LobeLight result;
    if (max(mirrored_weight.r, max(mirrored_weight.g, mirrored_weight.b)) > 0.0) {
        result.mirrored = mirrored / max(mirrored_weight, vec3(1e-30));
    } else {
        result.mirrored = averaged_radiance(p_room, mirror_env, 0.0);
    }
    result.through = vec3(0.0);
#if TRANSMISSION
    result.through = through_weight > 0.0 ? through / through_weight : averaged_radiance(p_room, through_env, 0.0);
#endif
    return result;
}
#endif
