/* Arithmetic on LANES numbers at once, one of each segment that a sweep simulates side by side.

   Every lane is computed as if it were alone: nothing here depends on what the other lanes hold. The vectors are those
   of GCC and Clang, which split them where the processor's are shorter. Of functions that the mathematical library has
   for single numbers only the first `live` lanes are computed. */

#include <math.h>
#include <string.h>

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef long long mask __attribute__((vector_size(8 * LANES)));
typedef unsigned long long unsigned_mask __attribute__((vector_size(8 * LANES)));

static inline lanes splat(double value) { return (lanes){0} + value; }

/* x where the mask is set, else 0; x or y; 1 or 0. */
static inline lanes pick(mask chosen, lanes x) { return (lanes)(chosen & (mask)x); }
static inline lanes blend(mask chosen, lanes x, lanes y) { return (lanes)((chosen & (mask)x) | (~chosen & (mask)y)); }
static inline lanes number(mask chosen) { return pick(chosen, splat(1.0)); }

static inline int any(mask chosen) {
  long long found = 0;
  for (int i = 0; i < LANES; ++i) found |= chosen[i];
  return found != 0;
}

static inline lanes lanes_fabs(lanes x) { return (lanes)((mask)x & ((mask){0} + 0x7fffffffffffffffLL)); }
static inline lanes lanes_fmax(lanes x, lanes y) { return blend((mask)(x > y) | (mask)(y != y), x, y); }
static inline lanes lanes_fmin(lanes x, lanes y) { return blend((mask)(x < y) | (mask)(y != y), x, y); }
static inline lanes lanes_sign(lanes x) { return number((mask)(x > 0.0)) - number((mask)(x < 0.0)) + pick((mask)(x != x), x); }
static inline lanes lanes_sqrt(lanes x) {
  for (int i = 0; i < LANES; ++i) x[i] = __builtin_sqrt(x[i]);
  return x;
}

#define ONE_BY_ONE(name)                              \
  static inline lanes lanes_##name(lanes x, int live) { \
    for (int i = 0; i < live; ++i) x[i] = name(x[i]); \
    return x;                                         \
  }
#define PAIR_BY_PAIR(name)                                     \
  static inline lanes lanes_##name(lanes x, lanes y, int live) { \
    for (int i = 0; i < live; ++i) x[i] = name(x[i], y[i]);    \
    return x;                                                  \
  }
ONE_BY_ONE(log1p)
ONE_BY_ONE(tan)
ONE_BY_ONE(asin)
ONE_BY_ONE(acos)
ONE_BY_ONE(atan)
ONE_BY_ONE(sinh)
ONE_BY_ONE(cosh)
ONE_BY_ONE(asinh)
ONE_BY_ONE(acosh)
ONE_BY_ONE(atanh)
ONE_BY_ONE(erf)
ONE_BY_ONE(floor)
ONE_BY_ONE(ceil)
PAIR_BY_PAIR(pow)
PAIR_BY_PAIR(fmod)
PAIR_BY_PAIR(remainder)
PAIR_BY_PAIR(atan2)
PAIR_BY_PAIR(hypot)
PAIR_BY_PAIR(copysign)
