/* Elementary functions of lanes (lanes.h): to within two units in the last place, and as the mathematical library has
   them for 0, infinity and what is not a number. Reductions and polynomials are those of fdlibm (Sun Microsystems 1993). */

#define TO_INTEGER 0x1.8p52 /* added to a number below 2^51, it leaves the nearest integer in the lowest bits */
#define LN2_HIGH 6.93147180369123816490e-01
#define LN2_LOW 1.90821492927058770002e-10

/* p = e^r - 1 and half = 2^(n - 1) with e^x = 2 half (1 + p) and |r| <= ln 2 / 2, for x between -708 and 710. */
static inline lanes exponential(lanes x, lanes *half) {
  lanes shifted = x * 1.44269504088896338700 + TO_INTEGER, n = shifted - TO_INTEGER;
  lanes r = (x - n * LN2_HIGH) - n * LN2_LOW, sum = splat(1.0 / 6227020800.0);
  static const double factorials[] = {479001600.0, 39916800.0, 3628800.0, 362880.0, 40320.0, 5040.0,
                                      720.0,       120.0,      24.0,      6.0,      2.0,     1.0};
  for (int i = 0; i < 12; ++i) sum = sum * r + 1.0 / factorials[i];
  *half = (lanes)(((mask)shifted << 52) + (1022LL << 52));
  return sum * r;
}

static inline lanes between(lanes low, lanes x, lanes high) {
  return blend((mask)(x < low), low, blend((mask)(x > high), high, x));
}

static inline lanes lanes_exp(lanes x) {
  lanes half, p = exponential(between(splat(-708.0), x, splat(710.0)), &half);
  return pick(~(mask)(x < -708.0), (1.0 + p) * half * 2.0);
}

static inline lanes lanes_expm1(lanes x) {
  lanes half, p = exponential(between(splat(-708.0), x, splat(710.0)), &half);
  return (p * half + (half - 0.5)) * 2.0;
}

static inline lanes lanes_tanh(lanes x) {
  lanes fallen = lanes_expm1(-2.0 * lanes_fabs(x)), size = -fallen / (2.0 + fallen);
  return blend((mask)(x < 0.0), -size, size);
}

static inline lanes lanes_log(lanes x) {
  const long long root = 0x3fe6a09e00000000LL; /* sqrt(1/2), below which a fraction is doubled */
  mask tiny = (mask)(x < 0x1p-1022), bits = (mask)blend(tiny, x * 0x1p54, x);
  mask raised = (mask)((unsigned_mask)(bits - root + (1024LL << 52)) >> 52);
  lanes n = (lanes)(raised | 0x4330000000000000LL) - (0x1p52 + 1024.0) - pick(tiny, splat(54.0));
  lanes f = (lanes)(bits - ((raised - 1024) << 52)) - 1.0, s = f / (2.0 + f), z = s * s, w = z * z;
  lanes even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
  lanes odd = z * (6.666666666666735130e-01 +
                   w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
  lanes square = 0.5 * f * f, found = s * (square + even + odd) + n * LN2_LOW - square + f + n * LN2_HIGH;
  found = blend((mask)(x == 0.0), splat(-INFINITY), blend((mask)(x < 0.0), splat(NAN), found));
  return blend((mask)(x == INFINITY) | (mask)(x != x), x, found);
}

/* Sine (shift 0) or cosine (shift 1) of angles that quarter turns are taken from exactly; one by one beyond. */
static inline lanes wave(lanes x, long long shift, int live) {
  lanes shifted = x * 6.36619772367581382433e-01 + TO_INTEGER, n = shifted - TO_INTEGER;
  lanes r = ((x - n * 1.57079632673412561417e+00) - n * 6.07710050630396597660e-11) - n * 2.02226624879595063154e-21;
  lanes z = r * r;
  mask quarter = (mask)shifted + shift, inside = (mask)(lanes_fabs(x) < 1e5);
  lanes sine = r + r * z * (-1.66666666666666324348e-01 +
                            z * (8.33333333332248946124e-03 +
                                 z * (-1.98412698298579493134e-04 +
                                      z * (2.75573137070700676789e-06 +
                                           z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
  lanes cosine = 1.0 - 0.5 * z +
                 z * z * (4.16666666666666019037e-02 +
                          z * (-1.38888888888741095749e-03 +
                               z * (2.48015872894767294178e-05 +
                                    z * (-2.75573143513906633035e-07 +
                                         z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  lanes found = blend((mask)((quarter & 1) != 0), cosine, sine);
  found = blend((mask)((quarter & 2) != 0), -found, found);
  for (int i = 0; i < live; ++i)
    if (!inside[i]) found[i] = shift ? cos(x[i]) : sin(x[i]);
  return found;
}

static inline lanes lanes_sin(lanes x, int live) { return wave(x, 0, live); }
static inline lanes lanes_cos(lanes x, int live) { return wave(x, 1, live); }
