// Bumps too fine to be seen one by one, as the spread of the normals and of the directions that they make. Twin:
// glbump/reference/spread.py. A spread is a covariance: of small changes of a vector, the mean of change * change^T.

// Spread of a s.x + b s.y, from the second moments (uu, uv, vv) of s.
mat3 spread_along(vec3 a, vec3 b, vec3 moments) {
    return outerProduct(a, moments.x * a + moments.y * b) + outerProduct(b, moments.y * a + moments.z * b);
}

// Spread of what `change` makes of a vector with this spread.
mat3 carried_spread(mat3 change, mat3 spread) {
    return change * spread * transpose(change);
}

// Spread of bump_normal(n, gradient), from that of the gradient, to the first order: the normal changes by what the
// gradient's change has across it, over the length of n - gradient. In units of slopes against the bent surface. Where
// the gradient's spread leaves 32-bit floats, and where it is past 1e16, all normals are alike: 1e16 each way across.
mat3 normal_spread(vec3 n, vec3 gradient, mat3 spread) {
    vec3 bent = n - gradient;
    vec3 a = abs(bent);
    float largest = max(a.x, max(a.y, a.z));
    bent /= largest;
    float inverse = inversesqrt(dot(bent, bent));
    vec3 m = bent * inverse;
    mat3 across = mat3(1.0) - outerProduct(m, m);
    // Divided twice by the length: its square may leave 32-bit floats.
    mat3 result = carried_spread(across, spread * (inverse / largest)) * (inverse / largest);
    float total = result[0].x + result[1].y + result[2].z;
    return total < 1e16 ? result : 1e16 * across;
}

// The same of unit vectors, which cannot lie farther apart than a sphere is wide: s / (1 + 2 tr s). Of slopes s with a
// Gaussian distribution the mean of s^2 / (1 + s^2), to the second order; for slopes of 1/2 rms along each axis 10 % low.
mat3 unit_spread(mat3 spread) {
    return spread / (1.0 + 2.0 * (spread[0].x + spread[1].y + spread[2].z));
}

// How reflect_dir changes with n: d(r) = -2 ((dir . dn) n + (dir . n) dn). Twice dn in the plane of incidence; across it
// twice the cosine of incidence as much (NUMERICS 2.4).
mat3 reflect_matrix(vec3 dir, vec3 n) {
    return -2.0 * (outerProduct(n, dir) + mat3(dot(dir, n)));
}

// How refract_dir changes with n, in directions across n.
mat3 refract_matrix(vec3 dir, vec3 n, float eta) {
    float along = dot(dir, n);
    vec3 across = eta * (dir - along * n);
    float rest = 1.0 - dot(across, across);
    if (rest < 0.0) return reflect_matrix(dir, n);
    // T = eta dir + (through - eta along) n, where along changes by dir . dn and through by eta^2 along / through of that.
    // Next to the critical angle that has no bound: from a cosine of 1e-3 on it stays as it is.
    float through = along > 0.0 ? max(sqrt(rest), 1e-3) : -max(sqrt(rest), 1e-3);
    return outerProduct(n, (eta * eta * along / through - eta) * dir) + mat3(through - eta * along);
}

// The mean of |x + y|, x normally distributed about 0 with variance 1: y erf(y / sqrt 2) + sqrt(2 / pi) exp(-y^2 / 2),
// for y >= 0. erf by tanh (Hendrycks and Gimpel, "Gaussian Error Linear Units", 2016): 1e-3 off at most.
float folded_mean(float y) {
    const float ROOT = 0.79788456080286535588;  // of 2 / pi
    return y * tanh(ROOT * min(y + 0.044715 * y * y * y, 12.0)) + ROOT * exp(-0.5 * y * y);
}

// above_surface(dir, n) for directions with a spread about dir, some of which lie below: the mean of where they are
// mirrored to. Their heights are taken as Gaussian. Unit length.
vec3 folded_dir(vec3 dir, vec3 n, mat3 spread) {
    float height = dot(dir, n);
    float s = sqrt(max(dot(n, spread * n), 1e-20));
    return normalize(dir + (s * folded_mean(abs(height) / s) - height) * n);
}

// And their spread about that: less along n by as much as the mirror brings them together.
mat3 folded_spread(vec3 dir, vec3 n, mat3 spread) {
    float s = sqrt(max(dot(n, spread * n), 1e-20));
    float y = abs(dot(dir, n)) / s;
    float mean = folded_mean(y);
    float left = sqrt(clamp(1.0 - (mean - y) * (mean + y), 0.0, 1.0));
    return carried_spread(mat3(1.0) + (left - 1.0) * outerProduct(n, n), spread);
}

// The footprint of a unit direction, ddx and ddy, widened by a spread times `sides` (the square of the footprint's side
// over the variance of what is averaged across it): two vectors at right angles to each other and to dir, whose sum of
// w w^T is ddx ddx^T + ddy ddy^T + sides * spread, the longer one first.
void widened_footprint(vec3 dir, vec3 ddx, vec3 ddy, mat3 spread, float sides, out vec3 wide_x, out vec3 wide_y) {
    vec3 t = normalize(abs(dir.x) > 0.6 ? vec3(dir.y, -dir.x, 0.0) : vec3(0.0, -dir.z, dir.y));
    vec3 b = cross(dir, t);
    vec2 x = vec2(dot(ddx, t), dot(ddx, b));
    vec2 y = vec2(dot(ddy, t), dot(ddy, b));
    vec3 st = spread * t;
    float tt = x.x * x.x + y.x * y.x + sides * dot(t, st);
    float bb = x.y * x.y + y.y * y.y + sides * dot(b, spread * b);
    float tb = x.x * x.y + y.x * y.y + sides * dot(b, st);
    // Eigenvectors of that 2x2 matrix: half the angle of (tt - bb, 2 tb).
    float half_sum = 0.5 * (tt + bb);
    float half_difference = 0.5 * (tt - bb);
    float apart = length(vec2(half_difference, tb));
    vec2 turn = apart > 0.0 ? vec2(half_difference, tb) / apart : vec2(1.0, 0.0);
    vec2 longer = turn.x > 0.0 ? vec2(1.0 + turn.x, turn.y) : vec2(abs(turn.y), turn.y < 0.0 ? turn.x - 1.0 : 1.0 - turn.x);
    longer = normalize(longer);
    // The smaller one as the determinant over the larger, which cancels less than their difference.
    float larger = half_sum + apart;
    float smaller = larger > 0.0 ? max(tt * bb - tb * tb, 0.0) / larger : 0.0;
    wide_x = sqrt(larger) * (longer.x * t + longer.y * b);
    wide_y = sqrt(smaller) * (longer.x * b - longer.y * t);
}

const int SPREAD_TAPS = 4;
const float LEAST_TAP = 0.45;  // of the longer axis: about as far apart as taps are then, so that nothing falls between

// A widened footprint as SPREAD_TAPS rounder ones, tap_x and tap_y each, along its longer axis: number i at
// (i - (SPREAD_TAPS - 1) / 2) step. Together they vary as the whole: along wide_x tap_x^2 + step^2 (SPREAD_TAPS^2 - 1) / 12
// times 4, for levels whose texels are averaged over a variance of a quarter of their square.
void spread_taps(vec3 wide_x, vec3 wide_y, out vec3 step, out vec3 tap_x, out vec3 tap_y) {
    float longer = length(wide_x);
    float shorter = length(wide_y);
    float side = max(shorter, LEAST_TAP * longer);
    vec3 axis = longer > 0.0 ? wide_x / longer : vec3(0.0);
    tap_x = side * axis;
    tap_y = shorter > 0.0 ? side / shorter * wide_y : vec3(0.0);
    const float count = float(SPREAD_TAPS);
    step = sqrt((longer - side) * (longer + side) * 3.0 / (count * count - 1.0)) * axis;
}

// Roughness of facets of `roughness` on a surface whose bent normals have this spread: alpha^2 + 2 sigma^2, sigma^2 being
// the mean variance of slopes along both axes (the sum of two Gaussian distributions of slopes; Olano and Baker, "LEAN
// Mapping", 2010; Tokuyoshi and Kaplanyan, "Improved Geometric Specular Antialiasing", 2019). At most 1.
float spread_roughness(float roughness, mat3 spread) {
    float square = roughness * roughness;
    return sqrt(sqrt(min(square * square + spread[0].x + spread[1].y + spread[2].z, 1.0)));
}
