// The bumps of a surface as this scene and this plan have them: BUMP layers, whose gradients add up. Glue: reads
// uniforms, dispatches to lib.
// Each layer's kind is a sum: SLOPES, NORMALS or HEIGHTS, CLAMPED where the map ends at its edge, PARAMETER where its
// amplitude is in units of u and v, TRIPLANAR where it lies along the object's axes, SCREEN where gradients of its heights
// are taken from pixel to pixel.

#define SLOPES 1
#define NORMALS 2
#define HEIGHTS 3
#define CLAMPED 4
#define PARAMETER 8
#define TRIPLANAR 16
#define SCREEN 32

// Kernels, as glbump/maps/gradients.py IN_SHADERS has them.
#define FORWARD 0
#define CENTRAL 1
#define HALF 2
#define SOBEL 3
#define SCHARR 4
#define FOURTH 5
#define BSPLINE 6
#define KERNEL_READS int[7](3, 4, 4, 8, 8, 8, 16)[KERNEL]

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
#if HAS_HEIGHTS || HAS_SCREEN
#include "lib/gradients.glsl"
#endif
#if SPREAD
#include "lib/spread.glsl"
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
#if SPREAD
// Level 0 of these is level 1 of the slopes: those of level 0 have no spread.
uniform sampler2D spread_0;
#if BUMP > 1
uniform sampler2D spread_1;
#endif
#if BUMP > 2
uniform sampler2D spread_2;
#endif
#if BUMP > 3
uniform sampler2D spread_3;
#endif
uniform vec3 spread_scale[4];  // what is kept, to squares of slopes as slope_scale has them
#if FLATS
uniform vec3 flat_moments[4];  // second moments of the slopes that count as flat, as slope_scale has them
#else
const vec3 flat_moments[4] = vec3[4](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
#endif
#else
// Handed on, and read by nothing.
#define spread_0 bump_0
#define spread_1 bump_1
#define spread_2 bump_2
#define spread_3 bump_3
#endif
// Of each layer; there are four at most.
uniform vec2 repeat[4];          // per unit of u and v, or of the object's coordinates
uniform vec2 slope_scale[4];  // slopes of the map to those of the surface's u, v (of tangents, for normal maps)
#if HAS_TRIPLANAR
uniform vec3 origin_u[4];  // repeats from the object's origin to where its coordinates count from, along each axis
uniform vec3 origin_v[4];
#endif
#if BUMP_FULL || HAS_SCREEN
uniform float height_scale[4];
#endif
#if HAS_CODES
uniform vec3 code_range[4];  // what the last code stands for, of slopes and heights
#endif
#if BUMP_MIP
uniform float bump_footprint;  // of a sample, in pixels, times LEVEL_WIDTH
#endif
#if BUMP_TAPS > 1 || BUMP_GRADIENTS
const float LEVEL_WIDTH = 0.57735026918962576;  // of levels, over footprints': as glbump/relief.py has it
#endif

// Where on the surface, and how that changes from pixel to pixel.
struct Place {
#if HAS_UV
    vec2 uv;
    vec2 uv_dx;
    vec2 uv_dy;
#endif
#if HAS_TRIPLANAR
    vec3 p;  // of the object
    vec3 p_dx;
    vec3 p_dy;
    vec3 n;
#if SPREAD
    vec3 x;  // what gradients in the object's coordinates are along both axes of the tangent plane: their products with these
    vec3 y;
#endif
#endif
};

// What the layers add up to.
struct Relief {
    float height;
    vec2 by_uv;         // dB/du, dB/dv of heights in lengths of the surface
    vec2 by_parameter;  // of heights in units of u and v
    vec2 by_tangent;    // slopes along tangent and bitangent
    vec3 by_object;     // gradient in the object's coordinates
    float on_screen;    // heights whose gradient is left to the screen
#if SPREAD
    // Second moments (uu, uv, vv) of the slopes above that are not seen one by one, and of those of them that are flat; of
    // by_object along Place's x and y.
    mat2x3 spread_by_uv;
    mat2x3 spread_by_parameter;
    mat2x3 spread_by_tangent;
    mat2x3 spread_by_object;
    float flats;  // the share of places where every layer is flat, of those that are not seen one by one
#endif
};

// Where a map is averaged: over which footprint, as changes of u, v; or at which level.
#if BUMP_GRADIENTS
#define DETAIL vec4
vec4 texture_at(sampler2D map, vec2 place, vec4 detail) {
    return textureGrad(map, place, detail.xy, detail.zw);
}
#else
#define DETAIL float
vec4 texture_at(sampler2D map, vec2 place, float detail) {
    return textureLod(map, place, detail);
}
#endif

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
vec3 relief_texel(sampler2D map, const int i, const int stored, float middle, vec2 place, DETAIL detail) {
    READS(stored >= FOLDED ? 4.0 : 1.0);
#if HAS_FOLDED
    if (stored >= FOLDED) return vec3(octahedral_slope(map, place, stored, middle), 0.0);
#endif
    vec3 texel = texture_at(map, place, detail).rgb;
#if HAS_CODES
    if (stored == CODED) return signed_codes(texel, middle) * code_range[i];
    if (stored == XY) return vec3(slope_from_normal(normal_from_rg(texel.rg, middle)), 0.0);
    if (stored == XYZ) return vec3(slope_from_normal(normal_from_rgb(texel, middle)), 0.0);
#endif
    return texel;
}

#if BUMP_GRADIENTS
// Levels are narrower than footprints: the texture unit's by the width of what it is told, its places along the length.
vec4 bump_detail(sampler2D map, vec2 ddx, vec2 ddy) {
    vec2 size = vec2(textureSize(map, 0));
    vec3 major, minor;
    footprint_axes(vec3(ddx * size, 0.0) * bump_footprint, vec3(ddy * size, 0.0) * bump_footprint, major, minor);
    return vec4(major.xy / LEVEL_WIDTH, minor.xy) / size.xyxy;
}
#elif BUMP_MIP
float bump_detail(sampler2D map, vec2 ddx, vec2 ddy) {
    vec2 size = vec2(textureSize(map, 0)) * bump_footprint;
    return isotropic_level(ddx * size, ddy * size);
}
#endif

#if SPREAD
// moments_across for both columns.
mat2x3 spread_across(vec3 x, vec3 y, vec3 u, vec3 v, mat2x3 moments) {
    return mat2x3(moments_across(x, y, u, v, moments[0]), moments_across(x, y, u, v, moments[1]));
}

// Second moments (uu, uv, vv) of the slopes that texel_at averages, which independent layers' add up to; and how many of
// those slopes are steep.
vec4 spread_at(sampler2D spread, const int kind, const int i, const int stored, vec2 place, float level) {
    // These are read at level 0.
    if ((kind & 3) == HEIGHTS || stored >= FOLDED) return vec4(0.0, 0.0, 0.0, 1.0);
    READS(1.0);
    vec4 kept = textureLod(spread, place, level - 1.0);  // without a fourth channel 1
#if SPREAD == TOKSVIG
    kept.rgb = vec3(kept.r, 0.0, kept.r);
#elif SPREAD != LEAN
#error "SPREAD must be 0, TOKSVIG or LEAN"
#endif
    if ((kind & CLAMPED) != 0) {
        vec2 inside = step(0.0, place) * step(place, vec2(1.0));
        kept.rgb *= inside.xxy * inside.xyy;
        kept.a = mix(1.0, kept.a, inside.x * inside.y);
    }
    float averaged = clamp(level, 0.0, 1.0);
    return vec4(averaged * spread_scale[i] * kept.rgb, mix(1.0, kept.a, averaged));
}
#endif

// Slopes of the map at `place`; and in b its height.
vec3 texel_at(sampler2D map, const int kind, const int i, const int stored, float middle, vec2 place, DETAIL detail) {
#if HAS_HEIGHTS
    if ((kind & 3) == HEIGHTS && (kind & SCREEN) == 0) {
        READS(float(KERNEL_READS + BUMP_FULL * (KERNEL == BSPLINE ? 16 : 1)));
#if BUMP_FULL && KERNEL == BSPLINE
        return vec3(slope_at(map, place), height_bspline(map, place));
#elif BUMP_FULL
        return vec3(slope_at(map, place), height_at(map, place));
#else
        return vec3(slope_at(map, place), 0.0);
#endif
    }
#endif
#if HAS_SCREEN && KERNEL == BSPLINE
    if ((kind & SCREEN) != 0) {
        READS(16.0);
        return vec3(0.0, 0.0, height_bspline(map, place));
    }
#endif
#if SHOW == SHOW_LEVEL
    if (i == 0) shown.g = detail;
#endif
#if HAS_SCREEN
    if ((kind & SCREEN) != 0) {
        READS(1.0);
        return vec3(0.0, 0.0, texture_at(map, place, detail).r);
    }
#endif
    vec3 texel = relief_texel(map, i, stored, middle, place, detail);
    // Beyond the edge of a map that ends the height goes on as it is at the edge.
    if ((kind & CLAMPED) != 0) texel.rg *= step(0.0, place) * step(place, vec2(1.0));
    return texel;
}

#if BUMP_TAPS > 1
bool has_levels(const int kind, const int stored) {
#if HAS_SCREEN && KERNEL != BSPLINE
    if ((kind & SCREEN) != 0) return true;
#endif
    return (kind & 3) != HEIGHTS && stored < FOLDED;
}
#endif

// Slopes of the map about `place`, which changes by ddx and ddy from pixel to pixel; and in b its height. around: of
// the slopes that this averages, as spread_at has it.
vec3 averaged_texel(sampler2D map, sampler2D spread, const int kind, const int i, const int stored, float middle,
                    vec2 place, vec2 ddx, vec2 ddy, out vec4 around) {
    around = vec4(0.0, 0.0, 0.0, 1.0);
#if BUMP_TAPS > 1
    float taps = 1.0, level = 0.0;
    vec2 step = vec2(0.0);
    if (has_levels(kind, stored)) {
        vec2 size = vec2(textureSize(map, 0));
        vec3 major, minor;
        footprint_axes(vec3(ddx * size, 0.0) * bump_footprint, vec3(ddy * size, 0.0) * bump_footprint, major, minor);
        taps = footprint_taps(major, minor, 1.0, float(BUMP_TAPS));
        level = isotropic_level(major.xy / taps, minor.xy);
        // Levels are narrower than footprints, taps lie all along them.
        step = major.xy / (LEVEL_WIDTH * taps * size);
    }
    vec3 mean = vec3(0.0);
    for (float tap = 0.0; tap < taps; tap += 1.0) {
        vec2 at = place + (tap + 0.5 - 0.5 * taps) * step;
        vec3 texel = texel_at(map, kind, i, stored, middle, at, level);
        vec3 off = texel - mean;
        mean += off / (tap + 1.0);
#if SPREAD
        // What each averages, and how they differ: about the mean so far, and about it with this one, so that nothing
        // cancels (Welford, "Note on a Method for Calculating Corrected Sums of Squares and Products", 1962).
        vec2 before = off.rg * slope_scale[i];
        vec2 after = (texel - mean).rg * slope_scale[i];
        vec4 at_tap = spread_at(spread, kind, i, stored, at, level);
        around += (at_tap + vec4(before.xxy * after.xyy, 0.0) - around) / (tap + 1.0);
#endif
    }
    return mean;
#else
#if BUMP_MIP
    DETAIL detail = bump_detail(map, ddx, ddy);
#else
    const float detail = 0.0;
#endif
#if SPREAD
    around = spread_at(spread, kind, i, stored, place, detail);
#endif
    return texel_at(map, kind, i, stored, middle, place, detail);
#endif
}

#if HAS_TRIPLANAR
// One of the three maps: right and up, along axes of the object, are where its u and v grow.
void add_plane(inout Relief r, sampler2D map, sampler2D spread, const int kind, const int i, const int stored,
               float middle, Place at, float share, vec3 right, vec3 up, inout float flats) {
    vec2 place = vec2(dot(at.p * repeat[i].x + origin_u[i], right), dot(at.p * repeat[i].y + origin_v[i], up));
    vec2 ddx = vec2(dot(at.p_dx, right), dot(at.p_dx, up)) * repeat[i];
    vec2 ddy = vec2(dot(at.p_dy, right), dot(at.p_dy, up)) * repeat[i];
    vec4 around;
    vec3 texel = averaged_texel(map, spread, kind, i, stored, middle, place, ddx, ddy, around);
    vec2 slope = texel.rg * slope_scale[i];
    r.by_object += share * (slope.x * right + slope.y * up);
#if SPREAD
    r.spread_by_object += share * share * spread_across(at.x, at.y, right, up, mat2x3(around.rgb, flat_moments[i]));
    flats += share * (1.0 - around.a);
#endif
#if HAS_SCREEN
    if ((kind & SCREEN) != 0) r.on_screen += share * height_scale[i] * texel.b;
#endif
}
#endif

void add_layer(inout Relief r, sampler2D map, sampler2D spread, const int kind, const int i, const int stored,
               float middle, Place at) {
#if HAS_TRIPLANAR
    if ((kind & TRIPLANAR) != 0) {
        // Each is seen upright from outside, on both of its sides.
        vec3 share = triplanar_shares(at.n);
        vec3 side = vec3(at.n.x < 0.0 ? -1.0 : 1.0, at.n.y < 0.0 ? -1.0 : 1.0, at.n.z < 0.0 ? -1.0 : 1.0);
        float flats = 0.0;
        add_plane(r, map, spread, kind, i, stored, middle, at, share.x, vec3(0.0, 0.0, -side.x), vec3(0.0, 1.0, 0.0), flats);
        add_plane(r, map, spread, kind, i, stored, middle, at, share.y, vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, -side.y), flats);
        add_plane(r, map, spread, kind, i, stored, middle, at, share.z, vec3(side.z, 0.0, 0.0), vec3(0.0, 1.0, 0.0), flats);
#if SPREAD
        r.flats *= flats;
#endif
        return;
    }
#endif
#if HAS_UV
    vec2 times = repeat[i];
    vec4 around;
    vec3 texel = averaged_texel(map, spread, kind, i, stored, middle, at.uv * times, at.uv_dx * times,
                                at.uv_dy * times, around);
    vec2 slope = texel.rg * slope_scale[i];
#if HAS_SCREEN
    if ((kind & SCREEN) != 0) {
        r.on_screen += height_scale[i] * texel.b;
        return;
    }
#endif
#if SPREAD
    mat2x3 moments = mat2x3(around.rgb, flat_moments[i]);
    r.flats *= 1.0 - around.a;
    if ((kind & 3) == NORMALS) {
        r.spread_by_tangent += moments;
    } else if ((kind & PARAMETER) != 0) {
        r.spread_by_parameter += moments;
    } else {
        r.spread_by_uv += moments;
    }
#endif
    if ((kind & 3) == NORMALS) {
        r.by_tangent += slope;
    } else if ((kind & PARAMETER) != 0) {
        r.by_parameter += slope;
    } else {
        r.by_uv += slope;
#if BUMP_FULL
        r.height += height_scale[i] * texel.b;
#endif
    }
#endif
}

Relief relief_at(Place at) {
    Relief r;
    r.height = r.on_screen = 0.0;
    r.by_uv = r.by_parameter = r.by_tangent = vec2(0.0);
    r.by_object = vec3(0.0);
#if SPREAD
    r.spread_by_uv = r.spread_by_parameter = r.spread_by_tangent = r.spread_by_object = mat2x3(0.0);
    r.flats = 1.0;
#endif
    add_layer(r, bump_0, spread_0, BUMP_0, 0, STORED_0, float(MIDDLE_0), at);
#if BUMP > 1
    add_layer(r, bump_1, spread_1, BUMP_1, 1, STORED_1, float(MIDDLE_1), at);
#endif
#if BUMP > 2
    add_layer(r, bump_2, spread_2, BUMP_2, 2, STORED_2, float(MIDDLE_2), at);
#endif
#if BUMP > 3
    add_layer(r, bump_3, spread_3, BUMP_3, 3, STORED_3, float(MIDDLE_3), at);
#endif
    return r;
}
