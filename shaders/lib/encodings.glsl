// Normals and slopes from how textures store them. Twin: glbump/reference/encodings.py; to store them, and what each
// costs: glbump/maps/encodings.py. c is what a texture of unsigned integers gives, 0..1; `middle` is the code that
// stands for 0: 128 of 8 bits, 512 of 10, 2048 of 12, 32768 of 16.

// Codes 1..2 middle - 1 as -1..1. 2 c - 1 would have no code for 0: a flat normal of 8 bits would lean by 0.32 degrees.
vec3 signed_codes(vec3 c, float middle) {
    return ((2.0 * middle - 1.0) * c - middle) / (middle - 1.0);
}

vec3 normal_from_rgb(vec3 c, float middle) {
    return normalize(signed_codes(c, middle));
}

// x and y; z from the unit length. Where the filter or the steps made them longer than 1 the normal lies flat.
vec3 normal_from_rg(vec2 c, float middle) {
    vec2 xy = signed_codes(vec3(c, 0.0), middle).xy;
    return normalize(vec3(xy, sqrt(max(1.0 - dot(xy, xy), 0.0))));
}

// The octahedron unfolded to a square (Cigolle et al. 2014). Neighbours across a fold must not be filtered: read texels,
// unfold each, then average.
vec3 normal_from_octahedral(vec2 c, float middle) {
    vec2 xy = signed_codes(vec3(c, 0.0), middle).xy;
    float z = 1.0 - abs(xy.x) - abs(xy.y);
    float fold = max(-z, 0.0);
    return normalize(vec3(xy.x - (xy.x < 0.0 ? -fold : fold), xy.y - (xy.y < 0.0 ? -fold : fold), z));
}

// Two codes of 12 bits, as 0..1 of 4095, from three bytes: for normal_from_octahedral with middle 2048.
vec2 codes_from_bytes(vec3 c) {
    vec3 bytes = floor(255.0 * c + 0.5);
    float high = floor(bytes.y / 16.0);
    return vec2(bytes.x * 16.0 + high, (bytes.y - 16.0 * high) * 256.0 + bytes.z) / 4095.0;
}

vec2 slope_from_rg(vec2 c, float middle, float steepest) {
    return steepest * signed_codes(vec3(c, 0.0), middle).xy;
}

// The slopes of a normal of any length, at most 128 (89.55 degrees; the bound of Mikkelsen's framework, 2020): what lies
// flat, or points inwards, is that steep.
vec2 slope_from_normal(vec3 n_tan) {
    float z = max(n_tan.z, max(abs(n_tan.x), abs(n_tan.y)) / 128.0);
    return z > 0.0 ? -n_tan.xy / z : vec2(0.0);
}
