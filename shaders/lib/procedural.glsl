// Environments that are computed, not looked up: colour = f(direction). Twin: glbump/reference/procedural.py.
// dir_env: unit length. ddx, ddy: its changes across the footprint of a sample, along both of its sides; zero
// for the function itself. What is finer than the footprint is averaged, so that nothing sparkles.

// The mean of y / length(y, softness) from y - reach to y + reach: -1 well below 0, 1 well above. The difference of
// the primitives length(y +- reach, softness), divided by 2 reach and written without cancellation.
float soft_sign(float y, float reach, float softness) {
    float both = length(vec2(y + reach, softness)) + length(vec2(y - reach, softness));
    return both > 0.0 ? 2.0 * y / both : 0.0;
}

// Half the height of a footprint: of an interval with the variance of the parallelogram's height.
float footprint_reach(vec3 ddx, vec3 ddy) {
    return 0.5 * length(vec2(ddx.y, ddy.y));
}

// The simple one: `up` above, `down` below; at the height `softness` (sine of the elevation) some 85 % of the way.
vec3 sky_radiance(vec3 dir_env, vec3 ddx, vec3 ddy, vec3 up, vec3 down, float softness) {
    float side = soft_sign(dir_env.y, footprint_reach(ddx, ddy), softness) * length(vec2(1.0, softness));
    return mix(down, up, 0.5 + 0.5 * clamp(side, -1.0, 1.0));
}

// sin(x) / x: what is left of a sinusoid that is averaged over a phase of 2 x. Near 0 by its series, to 2e-10.
float sinc(float x) {
    return abs(x) > 0.1 ? sin(x) / x : 1.0 - x * x / 6.0 * (1.0 - x * x / 20.0);
}

// The medium one: a sinusoid between `grey` and `silver`, `bands` of them from straight down to straight up, which a
// second one moves up and down by `sway` bands. Squared, 3/8 + sin / 2 - cos(2) / 8, so that on a display dark and
// bright take as much room. Over a parallelogram each of the two fades by two sincs, exact where the phase is linear.
vec3 chrome_radiance(vec3 dir_env, vec3 ddx, vec3 ddy, vec3 grey, vec3 silver, float bands, float sway) {
    const float TURN = 6.28318530717958647692;
    const vec3 wave = TURN * vec3(0.5, 0.0, 0.3);
    float swing = dot(wave, dir_env);
    float phase = TURN * (0.5 * bands * dir_env.y + sway * sin(swing));
    vec3 gradient = TURN * (vec3(0.0, 0.5 * bands, 0.0) + sway * cos(swing) * wave);
    float x = 0.5 * dot(gradient, ddx);
    float y = 0.5 * dot(gradient, ddy);
    float first = sinc(x) * sinc(y) * sin(phase);
    float second = sinc(2.0 * x) * sinc(2.0 * y) * cos(2.0 * phase);
    return mix(grey, silver, 0.375 + 0.5 * first - 0.125 * second);
}

// ------------------------------------------------------------------------------------------- the complex one

// A random number in -1..1 for each point of a lattice. Integers alone, so it is the same everywhere; the mixing
// is by multiplications and xor-shifts (Wellons, "Prospecting for Hash Functions", 2018).
float lattice_value(ivec2 cell, uint seed) {
    uint h = uint(cell.x) * 0x9e3779b1u + uint(cell.y) * 0x85ebca77u + seed * 0xc2b2ae3du;
    h = (h ^ (h >> 16u)) * 0x7feb352du;
    h = (h ^ (h >> 15u)) * 0x846ca68bu;
    h = h ^ (h >> 16u);
    return float(h >> 8u) * exp2(-23.0) - 1.0;
}

// Lattice values joined smoothly (second derivatives are continuous): value, and its derivatives along x and y.
vec3 value_noise(vec2 place, uint seed) {
    vec2 low = floor(place);
    vec2 f = place - low;
    vec2 s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    vec2 ds = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    ivec2 cell = ivec2(low);
    float a = lattice_value(cell, seed);
    float b = lattice_value(cell + ivec2(1, 0), seed) - a;
    float c = lattice_value(cell + ivec2(0, 1), seed) - a;
    float d = lattice_value(cell + ivec2(1, 1), seed) - a - b - c;
    return vec3(a + b * s.x + c * s.y + d * s.x * s.y, ds * (vec2(b, c) + d * s.yx));
}

const int OCTAVES = 9;
const float WIDEST = 4.0;        // the first octave's cells; the eye stands 0.5 above the ground
const float RIDGE_MEAN = 0.44;   // of an octave: what is left where it is finer than the footprint
const float RIDGE_SLOPE = 2.9;   // mean square of an octave's slope, its cells and its height being 1
const float GROUND = -0.5;
const float NEAREST = 0.25;
const float FARTHEST = 40.0;

// How much of their height mountains have at a distance from the eye, and its derivative: between 1 and 9 they rise.
vec2 valley(float away) {
    float x = clamp((away - 1.0) / 8.0, 0.0, 1.0);
    return vec2(0.04 + 0.96 * x * x * (3.0 - 2.0 * x), 0.72 * x * (1.0 - x));
}

// Mountains round a valley: height of the ground at place (x, z) below or above the eye, its derivatives, and the mean
// square of the slopes that these leave out. Ridges of octaves, each turned, half as wide and half as high as the one
// before; no lower than GROUND and no higher than GROUND + relief. Octaves finer than `width` give way to their mean,
// and crests narrower than it are rounded: the mean of |noise| over what the footprint spans of it.
vec4 landscape(vec2 place, float width, float relief, uint seed) {
    const vec3 mean = vec3(RIDGE_MEAN, 0.0, 0.0);
    vec3 sum = mean * (1.0 - exp2(-float(OCTAVES)));
    float lost = float(OCTAVES);
    float weight = 0.5;
    float cell = WIDEST;
    vec2 axis = vec2(1.0 / WIDEST, 0.0);
    for (int octave = 0; octave < OCTAVES && width < cell; ++octave) {
        vec2 turned = vec2(axis.x * place.x - axis.y * place.y, axis.y * place.x + axis.x * place.y);
        vec3 noise = value_noise(turned, seed + uint(octave));
        float reach = 0.05 + width / cell;
        float crease = abs(noise.x) < reach ? 0.5 * (noise.x * noise.x / reach + reach) : abs(noise.x);
        float top = max(1.0 - crease, 0.0);
        vec2 slope = vec2(axis.x * noise.y + axis.y * noise.z, axis.x * noise.z - axis.y * noise.y);
        vec3 ridge = vec3(top * top, -2.0 * top * clamp(noise.x / reach, -1.0, 1.0) * slope);
        float share = 1.0 - smoothstep(0.3, 1.0, width / cell);
        sum += weight * share * (ridge - mean);
        lost -= share * share;
        weight *= 0.5;
        cell *= 0.5;
        axis = 2.0 * vec2(0.8 * axis.x - 0.6 * axis.y, 0.6 * axis.x + 0.8 * axis.y);
    }
    float away = length(place);
    vec2 rise = valley(away);
    vec2 slope = rise.x * sum.yz + rise.y * sum.x * place / max(away, 1e-6);
    // Each octave is as steep as the next: half as high, over cells half as wide.
    float steep = relief * rise.x * 0.5 / WIDEST;
    return vec4(GROUND + relief * rise.x * sum.x, relief * slope, RIDGE_SLOPE * steep * steep * lost);
}

// The mean of the normals of ground as landscape() has it: the shorter, the more slopes are left out.
vec3 mean_normal(vec4 ground) {
    return vec3(-ground.y, 1.0, -ground.z) * inversesqrt(1.0 + dot(ground.yz, ground.yz) + ground.w);
}

// Colour of the ground of landscape() in sunlight and skylight: snow on what is high and flat, rock elsewhere.
// No brighter than the brighter of the two.
vec3 lit_ground(vec4 ground, float relief, vec3 rock, vec3 snow) {
    const vec3 SUN = vec3(-0.80, 0.36, 0.48);
    const vec3 SUNLIGHT = vec3(0.86, 0.80, 0.70);
    vec3 n = mean_normal(ground);
    float high = (ground.x - GROUND) / max(relief, 1e-6);
    float white = smoothstep(0.28, 0.46, high) * smoothstep(0.4, 0.9, n.y);
    return mix(rock, snow, white) * (SUNLIGHT * max(dot(n, SUN), 0.0) + (1.0 - SUNLIGHT) * (0.5 + 0.5 * n.y));
}

// Sine of the angle from the ground up to the ray, as seen from the eye, at a distance along it.
float clearance(vec3 dir_env, float far, vec4 ground) {
    return dir_env.y - ground.x / far;
}

// The distance of step 0 .. steps - 1, farther apart the farther away: square roots of it are evenly spaced. No powers:
// they are coarse on some drivers.
float march_distance(int number, int steps) {
    float x = float(number) / float(steps - 1);
    return NEAREST + (FARTHEST - NEAREST) * x * x;
}

// The complex one: where the ray meets a fractal landscape, which stands under a sky. The march looks at `steps`
// distances and takes the ground as straight between two; where the ground covers more of the footprint than before, it looks twice more. So 3 `steps` looks at most, some 40 in the mean.
vec3 fractal_radiance(vec3 dir_env, vec3 ddx, vec3 ddy, vec3 sky, vec3 haze, vec3 rock, vec3 snow, float relief,
                      uint seed, int steps) {
    float width = max(length(ddx), length(ddy));
    float up = max(soft_sign(dir_env.y, footprint_reach(ddx, ddy), 0.35), 0.0);
    vec3 air = mix(haze, sky, up);
    vec3 light = vec3(0.0);
    float open = 1.0;  // the share that nothing covers yet
    int i = 0;
    float far = NEAREST;
    float before = 0.0;  // the distance before, where the ray was above the ground there
    // The way to the mountains leads over a valley that the ground cannot rise out of.
    float across = length(dir_env.xz);
    while (i < steps && dir_env.y * far > GROUND + relief * valley(far * across).x + far * width) {
        before = far;
        far = march_distance(++i, steps);
    }
    while (open > 0.0) {
        float above = 0.0;
        float covered = 0.0;
        for (; i < steps; ++i) {
            if (dir_env.y > 0.0 && dir_env.y * far > GROUND + relief) return light + open * air;
            above = clearance(dir_env, far, landscape(far * dir_env.xz, far * width, relief, seed));
            covered = clamp(0.5 - above / max(width, 1e-6), 0.0, 1.0);
            if (1.0 - covered < open) break;
            before = above > 0.0 ? far : 0.0;
            far = march_distance(i + 1, steps);
        }
        if (i == steps) break;
        bool crossed = before > 0.0 && above <= 0.0;
        float at = crossed ? before : far;
        vec4 ground = landscape(at * dir_env.xz, at * width, relief, seed);
        if (crossed) {
            float was = before * clearance(dir_env, before, ground);
            at = mix(before, far, was / (was - far * above));
        }
        // Seen at a grazing angle, the footprint is longer on the ground than across the ray.
        float facing = max(abs(dot(mean_normal(ground), dir_env)), 0.1);
        ground = landscape(at * dir_env.xz, at * width / facing, relief, seed);
        float clear = exp2(-at / FARTHEST) * (1.0 - at * at / (FARTHEST * FARTHEST));
        light += (open + covered - 1.0) * mix(air, lit_ground(ground, relief, rock, snow), clear);
        open = 1.0 - covered;
        before = above > 0.0 ? far : 0.0;
        far = march_distance(++i, steps);
    }
    return light + open * air;
}
