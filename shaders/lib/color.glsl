// From linear light to what a screen shows; each channel by itself. Twins: glbump/reference/color.py.

// sRGB-encoded, of linear light 0..1 (IEC 61966-2-1).
vec3 srgb_from_linear(vec3 linear) {
    vec3 curved = 1.055 * pow(max(linear, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
    return mix(linear * 12.92, curved, vec3(greaterThan(linear, vec3(0.0031308))));
}

// Extended Reinhard curve, linear light 0 and above -> 0..1; `white` becomes 1 (Reinhard et al. 2002, eq. 4).
vec3 reinhard(vec3 linear, float white) {
    vec3 x = min(linear, white);
    return x * (1.0 + x / (white * white)) / (1.0 + x);
}

// A fit of the ACES reference rendering, linear light 0 and above -> 0..1.04 (Narkowicz 2016).
vec3 filmic(vec3 linear) {
    vec3 x = min(linear, 1e4);
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
}
