// Gradients of a height map, taken where it is seen. Twin: glbump/reference/gradients.py; of whole maps:
// glbump/maps/gradients.py.

// Each gives (dB/du, dB/dv) at uv: u, v run 0..1 over the map, however many texels it has. Heights are in r, at level 0:
// these are for maps seen at their own size or larger. Between texel centres all but slope_bspline read through
// the sampler's own filter, which has to be linear, and past the border as it wraps.
float height_at(sampler2D heights, vec2 uv) {
    return textureLod(heights, uv, 0.0).r;
}

// Error half a texel times the curvature: the slope is that of half a texel farther on.
vec2 slope_forward(sampler2D heights, vec2 uv) {
    vec2 size = vec2(textureSize(heights, 0));
    vec2 texel = 1.0 / size;
    float here = height_at(heights, uv);
    return size * vec2(height_at(heights, uv + vec2(texel.x, 0.0)) - here,
                       height_at(heights, uv + vec2(0.0, texel.y)) - here);
}

// Over `reach` texels to either side.
vec2 slope_across(sampler2D heights, vec2 uv, float reach) {
    vec2 size = vec2(textureSize(heights, 0));
    vec2 off = reach / size;
    return size * (0.5 / reach)
         * vec2(height_at(heights, uv + vec2(off.x, 0.0)) - height_at(heights, uv - vec2(off.x, 0.0)),
                height_at(heights, uv + vec2(0.0, off.y)) - height_at(heights, uv - vec2(0.0, off.y)));
}

vec2 slope_central(sampler2D heights, vec2 uv) {
    return slope_across(heights, uv, 1.0);
}

// The four reads of slope_central at half its error: what the filter smooths is not smoothed once more.
vec2 slope_half(sampler2D heights, vec2 uv) {
    return slope_across(heights, uv, 0.5);
}

// Two steps of central differences, extrapolated to none (Richardson).
vec2 slope_fourth(sampler2D heights, vec2 uv) {
    return (4.0 * slope_across(heights, uv, 1.0) - slope_across(heights, uv, 2.0)) / 3.0;
}

// Central differences, averaged across: (side, 1 - 2 side, side).
vec2 slope_smoothed(sampler2D heights, vec2 uv, float side) {
    vec2 size = vec2(textureSize(heights, 0));
    vec2 texel = 1.0 / size;
    float nw = height_at(heights, uv + vec2(-texel.x, texel.y)), ne = height_at(heights, uv + texel);
    float sw = height_at(heights, uv - texel), se = height_at(heights, uv + vec2(texel.x, -texel.y));
    vec2 corners = vec2((ne - nw) + (se - sw), (ne - se) + (nw - sw));
    return (1.0 - 2.0 * side) * slope_across(heights, uv, 1.0) + 0.5 * side * size * corners;
}

vec2 slope_sobel(sampler2D heights, vec2 uv) {
    return slope_smoothed(heights, uv, 0.25);
}

// (3, 10, 3) / 16: directions at their best (Scharr 2000).
vec2 slope_scharr(sampler2D heights, vec2 uv) {
    return slope_smoothed(heights, uv, 0.1875);
}

// Weights of the uniform cubic B-spline for the coefficients before, at, after and two after the place t, 0..1.
vec4 cubic_weights(float t) {
    float s = 1.0 - t;
    return vec4(s * s * s, 4.0 - 3.0 * t * t * (1.0 + s), 4.0 - 3.0 * s * s * (1.0 + t), t * t * t) / 6.0;
}

// Weights of its derivative, for the three differences of those four: the quadratic B-spline.
vec3 quadratic_weights(float t) {
    float s = 1.0 - t;
    return vec3(0.5 * s * s, 0.5 + s * t, 0.5 * t * t);
}

// The analytic slope of the cubic B-spline with these coefficients (glbump/maps/bspline.py): sixteen texels, weighted
// here because filters have 8 bits for it. The map repeats.
vec2 slope_bspline(sampler2D coefficients, vec2 uv) {
    ivec2 size = textureSize(coefficients, 0);
    vec2 place = fract(uv) * vec2(size) - 0.5;
    vec2 first = floor(place);
    vec2 t = place - first;
    vec4 across_u = cubic_weights(t.x), across_v = cubic_weights(t.y);
    vec3 along_u = quadratic_weights(t.x), along_v = quadratic_weights(t.y);
    // From one texel before, and whole maps on, so that nothing is negative: % is not defined there.
    ivec2 start = ivec2(first) - 1 + 2 * size;
    float slope_u = 0.0;
    vec4 rows;
    for (int j = 0; j < 4; j++) {
        vec4 c;
        for (int i = 0; i < 4; i++) {
            c[i] = texelFetch(coefficients, (start + ivec2(i, j)) % size, 0).r;
        }
        slope_u += across_v[j] * dot(along_u, c.yzw - c.xyz);
        rows[j] = dot(across_u, c);
    }
    return vec2(size) * vec2(slope_u, dot(along_v, rows.yzw - rows.xyz));
}

// The cubic B-spline itself, with these coefficients. The map repeats.
float height_bspline(sampler2D coefficients, vec2 uv) {
    ivec2 size = textureSize(coefficients, 0);
    vec2 place = fract(uv) * vec2(size) - 0.5;
    vec2 first = floor(place);
    vec2 t = place - first;
    vec4 across_u = cubic_weights(t.x), across_v = cubic_weights(t.y);
    ivec2 start = ivec2(first) - 1 + 2 * size;
    float height = 0.0;
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 4; i++) {
            height += across_v[j] * across_u[i] * texelFetch(coefficients, (start + ivec2(i, j)) % size, 0).r;
        }
    }
    return height;
}
