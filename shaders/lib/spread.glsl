// Bumps too fine to be seen one by one, as the spread of the normals and of the directions that they make: small changes
// of a vector, whose mean of change * change^T is a a^T + b b^T. So a spread is two vectors, as a footprint is, and turns
// into another's as a footprint's do: by bump_normal_change, reflect_dir_change, refract_dir_change. Twin:
// glbump/reference/spread.py.

#include "direction.glsl"

// Second moments (xx, xy, yy), along x and y, of s.x u + s.y v, from those (uu, uv, vv) of s.
vec3 moments_across(vec3 x, vec3 y, vec3 u, vec3 v, vec3 moments) {
    vec2 a = vec2(dot(u, x), dot(u, y));
    vec2 b = vec2(dot(v, x), dot(v, y));
    return moments.x * a.xxy * a.xyy + moments.y * vec3(2.0 * a.x * b.x, a.x * b.y + a.y * b.x, 2.0 * a.y * b.y)
         + moments.z * b.xxy * b.xyy;
}

// Spread of s.x x + s.y y, from second moments (xx, xy, yy) of s: the columns of their square root. What rounding made of
// moments of one line, a determinant below 0, counts as 0. Where they leave 32-bit floats, and where they are past 1e16, all
// slopes are alike.
void spread_along(vec3 x, vec3 y, vec3 moments, out vec3 a, out vec3 b) {
    float trace = moments.x + moments.z;
    bool is_known = trace < 1e16;
    // Root of M / trace: (M / trace + r I) / sqrt(1 + 2 r), r being that of its determinant (Cayley and Hamilton).
    vec3 m = is_known ? moments / max(trace, 1e-30) : vec3(0.5, 0.0, 0.5);
    float r = sqrt(max(m.x * m.z - m.y * m.y, 0.0));
    float size = sqrt((is_known ? trace : 1e16) / (1.0 + 2.0 * r));
    a = size * ((m.x + r) * x + m.y * y);
    b = size * (m.y * x + (m.z + r) * y);
}

// Slopes with a mean and second moments (xx, xy, yy) about it, of which about `share` are steep and the others flat, 0 on
// average: how many are steep, which is no less than leaves those a variance of 0 along the mean, and their own mean and
// moments. Moments past 1e16 have no flats.
void steep_part(float share, vec2 mean, vec3 moments, out float steep, out vec2 steep_mean, out vec3 steep_moments) {
    steep = 1.0;
    steep_mean = mean;
    steep_moments = moments;
    float trace = moments.x + moments.z;
    if (!(trace < 1e16)) return;
    // In shares of the largest of them, whose fourth powers are floats.
    float size = max(max(abs(mean.x), abs(mean.y)), max(sqrt(max(trace, 0.0)), 1e-18));
    vec2 m = mean / size;
    vec3 c = moments / size / size;
    vec3 squares = m.xxy * m.xyy;
    float fourth = (squares.x + squares.z) * (squares.x + squares.z);
    float along = max(dot(c, vec3(1.0, 2.0, 1.0) * squares), 0.0);
    steep = max(share, fourth / max(fourth + along, 1e-30));
    // Of fewer than a thousandth it does not matter how they lie.
    float times = 1.0 / max(steep, 1e-3);
    c = times * (c - (1.0 - steep) * times * squares);
    // What rounding makes of no variance.
    c.xz = max(c.xz, 0.0);
    float most = sqrt(c.x * c.z);
    c.y = clamp(c.y, -most, most);
    steep_mean = times * mean;
    steep_moments = size * size * c;
}

// What a spread in slopes is times, to be one of unit vectors, which cannot lie farther apart than a sphere is wide: s / (1
// + 2 tr s). Of slopes s with a Gaussian distribution the mean of s^2 / (1 + s^2), to the second order; for slopes of 1/2
// rms along each axis 10 % low.
float unit_share(vec3 a, vec3 b) {
    return inversesqrt(1.0 + 2.0 * (dot(a, a) + dot(b, b)));
}

// x normally distributed with variance 1, and |x + y|: the variance that this loses, 1 - var |x + y|, which the square of
// its mean gains, y^2 + this. 1.6e-4 off at most; the mean 8e-5, the deviation 1.1e-4. y >= 0.
float folded_share(float y) {
    float square = y * y;
    return 0.63661977236758134308 * exp(-square * (0.56975 - 0.0028 * min(square, 8.0)));
}

// above_surface(dir, n) for directions with a spread about dir, some of which lie below: the mean of where they are
// mirrored to, unit length, and their spread about that: less along n by as much as the mirror brings them together. Their
// heights are taken as Gaussian.
void folded(vec3 dir, vec3 n, vec3 a, vec3 b, out vec3 folded_dir, out vec3 folded_a, out vec3 folded_b) {
    float height = dot(dir, n);
    vec2 along = vec2(dot(a, n), dot(b, n));
    float variance = max(dot(along, along), 1e-20);
    float share = folded_share(abs(height) * inversesqrt(variance));
    folded_dir = normalize(dir + (sqrt(height * height + share * variance) - height) * n);
    float lost = 1.0 - sqrt(1.0 - share);
    folded_a = a - lost * along.x * n;
    folded_b = b - lost * along.y * n;
}

// The footprint of a unit direction, ddx and ddy, widened by a spread: unit axes at right angles to each other and to
// dir, and the squares of how long it is along them, the longer one first; the sum of square * axis * axis^T is that of
// w w^T of all four.
void widened_footprint(vec3 dir, vec3 ddx, vec3 ddy, vec3 a, vec3 b, out vec3 longer, out vec3 shorter,
                       out vec2 squares) {
    vec3 x, y;
    axes_across(dir, x, y);
    vec4 along_x = vec4(dot(ddx, x), dot(ddy, x), dot(a, x), dot(b, x));
    vec4 along_y = vec4(dot(ddx, y), dot(ddy, y), dot(a, y), dot(b, y));
    float xx = dot(along_x, along_x);
    float yy = dot(along_y, along_y);
    float xy = dot(along_x, along_y);
    // Eigenvectors of that 2x2 matrix: half the angle of (xx - yy, 2 xy), of whose sine and cosine the larger by a root.
    float half_difference = 0.5 * (xx - yy);
    float apart = length(vec2(half_difference, xy));
    vec2 uneven = apart > 0.0 ? vec2(half_difference, xy) / apart : vec2(1.0, 0.0);
    float larger = sqrt(0.5 + 0.5 * abs(uneven.x));
    float smaller = 0.5 * uneven.y / larger;
    vec2 turn = uneven.x < 0.0 ? vec2(abs(smaller), uneven.y < 0.0 ? -larger : larger) : vec2(larger, smaller);
    longer = turn.x * x + turn.y * y;
    shorter = turn.x * y - turn.y * x;
    // The smaller one as the determinant over the larger, which cancels less than their difference.
    float most = 0.5 * (xx + yy) + apart;
    squares = vec2(most, most > 0.0 ? max(xx * yy - xy * xy, 0.0) / most : 0.0);
}

const int SPREAD_TAPS = 3;
const float LEAST_TAP = 0.4;  // of the longer axis: taps are 1.4 times that apart then, so that nothing falls between

// A widened footprint, its squares as above, as SPREAD_TAPS round ones along its longer axis: how far they are apart, and
// how long each is: as the shorter axis, LEAST_TAP of the longer or a texel, for texels_per_radian texels a radian.
// Together they vary as the whole, if that is no shorter than a texel: along the longer axis side^2 + 4 step^2
// (SPREAD_TAPS^2 - 1) / 12, for levels whose texels are averaged over a variance of a quarter of their square.
vec2 spread_taps(vec2 squares, float texels_per_radian) {
    const float PLACES = float(SPREAD_TAPS * SPREAD_TAPS - 1) / 3.0;
    float side = max(sqrt(max(squares.y, LEAST_TAP * LEAST_TAP * squares.x)), 1.0 / texels_per_radian);
    return vec2(sqrt(max(squares.x - side * side, 0.0) / PLACES), side);
}

// Roughness of facets of `roughness` on a surface whose bent normals have this spread: alpha^2 + 2 sigma^2, sigma^2 being
// the mean variance of slopes along both axes (the sum of two Gaussian distributions of slopes; Olano and Baker, "LEAN
// Mapping", 2010; Tokuyoshi and Kaplanyan, "Improved Geometric Specular Antialiasing", 2019). At most 1.
float spread_roughness(float roughness, vec3 a, vec3 b) {
    float square = roughness * roughness;
    return sqrt(sqrt(min(square * square + dot(a, a) + dot(b, b), 1.0)));
}
