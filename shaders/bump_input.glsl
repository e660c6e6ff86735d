// The bumps of a surface as this scene and this plan have them: BUMP layers, whose gradients add up. Glue: reads
// uniforms, dispatches to lib.
// Each layer's kind is a sum: SLOPES, NORMALS or HEIGHTS, CLAMPED where the map ends at its edge, PARAMETER where its
// amplitude is in units of u and v.

#define SLOPES 1
#define NORMALS 2
#define HEIGHTS 3
#define CLAMPED 4
#define PARAMETER 8

// Kernels, as glbump/maps/gradients.py IN_SHADERS has them.
#define FORWARD 0
#define CENTRAL 1
#define HALF 2
#define SOBEL 3
#define SCHARR 4
#define FOURTH 5
#define BSPLINE 6

// How a map is stored, as glbump/maps/bump_formats.py has it.
#define PLAIN 0
#define CODED 1
#define XY 2
#define XYZ 3
#define FOLDED 4
#define FOLDED_BYTES 5

#include "lib/bump.glsl"
#include "lib/filter.glsl"
#if HAS_CODES
#include "lib/encodings.glsl"
#endif
#if HAS_HEIGHTS
#include "lib/gradients.glsl"
#endif

uniform sampler2D bump_0;
#if BUMP > 1
uniform sampler2D bump_1;
#endif
#if BUMP > 2
uniform sampler2D bump_2;
#endif
#if BUMP > 3
uniform sampler2D bump_3;
#endif
// Of each layer; there are four at most.
uniform vec2 repeat[4];
uniform vec2 slope_scale[4];  // slopes of the map to those of the surface's u, v (of tangents, for normal maps)
#if BUMP_FULL
uniform float height_scale[4];
#endif
#if HAS_CODES
uniform vec3 code_range[4];  // what the last code stands for, of slopes and heights
#endif
#if BUMP_MIP
uniform float bump_footprint;  // of a sample, in pixels
#endif

// What the layers add up to.
struct Relief {
    float height;
    vec2 by_uv;         // dB/du, dB/dv of heights in lengths of the surface
    vec2 by_parameter;  // of heights in units of u and v
    vec2 by_tangent;    // slopes along tangent and bitangent
};

#if HAS_HEIGHTS
vec2 slope_at(sampler2D heights, vec2 place) {
#if KERNEL == FORWARD
    return slope_forward(heights, place);
#elif KERNEL == CENTRAL
    return slope_central(heights, place);
#elif KERNEL == HALF
    return slope_half(heights, place);
#elif KERNEL == SOBEL
    return slope_sobel(heights, place);
#elif KERNEL == SCHARR
    return slope_scharr(heights, place);
#elif KERNEL == FOURTH
    return slope_fourth(heights, place);
#elif KERNEL == BSPLINE
    return slope_bspline(heights, place);
#else
#error "KERNEL must be one of the names above"
#endif
}
#endif

#if HAS_FOLDED
vec2 octahedral_texel(sampler2D map, ivec2 texel, const int stored, float middle) {
    vec3 c = texelFetch(map, texel, 0).rgb;
    return slope_from_normal(normal_from_octahedral(stored == FOLDED ? c.rg : codes_from_bytes(c), middle));
}

// A filter must not average across the folds: four texels, each unfolded first.
vec2 octahedral_slope(sampler2D map, vec2 place, const int stored, float middle) {
    ivec2 size = textureSize(map, 0);
    vec2 at = fract(place) * vec2(size) - 0.5;
    vec2 share = fract(at);
    ivec2 low = (ivec2(floor(at)) + size) % size;
    ivec2 high = (low + 1) % size;
    vec2 lower = mix(octahedral_texel(map, low, stored, middle),
                     octahedral_texel(map, ivec2(high.x, low.y), stored, middle), share.x);
    vec2 upper = mix(octahedral_texel(map, ivec2(low.x, high.y), stored, middle),
                     octahedral_texel(map, high, stored, middle), share.x);
    return mix(lower, upper, share.y);
}
#endif

// Slopes, and in b heights where there are any.
vec3 relief_texel(sampler2D map, const int i, const int stored, float middle, vec2 place, float level) {
#if HAS_FOLDED
    if (stored >= FOLDED) return vec3(octahedral_slope(map, place, stored, middle), 0.0);
#endif
    vec3 texel = textureLod(map, place, level).rgb;
#if HAS_CODES
    if (stored == CODED) return signed_codes(texel, middle) * code_range[i];
    if (stored == XY) return vec3(slope_from_normal(normal_from_rg(texel.rg, middle)), 0.0);
    if (stored == XYZ) return vec3(slope_from_normal(normal_from_rgb(texel, middle)), 0.0);
#endif
    return texel;
}

void add_layer(inout Relief r, sampler2D map, const int kind, const int i, const int stored, float middle, vec2 uv,
               vec2 ddx, vec2 ddy) {
    int how = kind & 3;
    vec2 place = uv * repeat[i];
#if HAS_HEIGHTS
    if (how == HEIGHTS) {
        r.by_uv += slope_at(map, place) * slope_scale[i];
#if BUMP_FULL
#if KERNEL == BSPLINE
        r.height += height_scale[i] * height_bspline(map, place);
#else
        r.height += height_scale[i] * height_at(map, place);
#endif
#endif
        return;
    }
#endif
#if BUMP_MIP
    vec2 size = vec2(textureSize(map, 0)) * repeat[i] * bump_footprint;
    float level = isotropic_level(ddx * size, ddy * size);
#else
    const float level = 0.0;
#endif
    vec3 texel = relief_texel(map, i, stored, middle, place, level);
    vec2 slope = texel.rg * slope_scale[i];
    // Beyond the edge of a map that ends the height goes on as it is at the edge.
    if ((kind & CLAMPED) != 0) slope *= step(0.0, place) * step(place, vec2(1.0));
    if (how == NORMALS) {
        r.by_tangent += slope;
    } else if ((kind & PARAMETER) != 0) {
        r.by_parameter += slope;
    } else {
        r.by_uv += slope;
#if BUMP_FULL
        r.height += height_scale[i] * texel.b;
#endif
    }
}

// ddx, ddy: change of uv from pixel to pixel.
Relief relief_at(vec2 uv, vec2 ddx, vec2 ddy) {
    Relief r = Relief(0.0, vec2(0.0), vec2(0.0), vec2(0.0));
    add_layer(r, bump_0, BUMP_0, 0, STORED_0, float(MIDDLE_0), uv, ddx, ddy);
#if BUMP > 1
    add_layer(r, bump_1, BUMP_1, 1, STORED_1, float(MIDDLE_1), uv, ddx, ddy);
#endif
#if BUMP > 2
    add_layer(r, bump_2, BUMP_2, 2, STORED_2, float(MIDDLE_2), uv, ddx, ddy);
#endif
#if BUMP > 3
    add_layer(r, bump_3, BUMP_3, 3, STORED_3, float(MIDDLE_3), uv, ddx, ddy);
#endif
    return r;
}
