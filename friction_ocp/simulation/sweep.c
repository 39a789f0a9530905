/* Loop of the generated maps of a drive over the samples of segments, with forward sensitivities.

   Above this text stand the code that CasADi generated from maps.py and the sizes
     NX NU NP NA NY            states, inputs, parameters, active parameters, outputs;
     NL NK                     most unknown torques, and constants of their equations, of any map;
     SZ_ARG SZ_RES SZ_IW SZ_W  work space that suffices for every generated function;
   then a table of the maps (STEP, OUTPUT and, where there are any, TICK and NOW) and the list DELAYS of the
   parameters that must be 0 for NOW to replace OUTPUT.
   Each map has the functions of maps.py: for unknown torques, if any, the constants of their equations and one step
   of Newton's method; the value; the value with its Jacobians by state and by active parameters, column major.
   Sensitivities have NC = NX + NA columns: the state at the segment's start, then the active parameters.
   Nothing here is static: calls from several threads at once are safe. */

#define NC (NX + NA)
#define SQUARE (NC * NC)
#define NEWTON_LIMIT 15
#define NEWTON_TOLERANCE 1e-8 /* of the last correction; Newton's method squares it */

typedef struct {
  double w[SZ_W];
  casadi_int iw[SZ_IW];
  const double *arg[SZ_ARG];
  double *res[SZ_RES];
  double value[NX + NY + NL], a[(NX + NY) * NX + 1], b[(NX + NY) * NA + 1], moved[(NX + NY) * NC + 1];
  double step_torques[NL + 1], output_torques[NL + 1], constants[NK + 1];
} work_space;

/* What a sweep is compared with: samples (n x NY, NaN where there is none) at the first node of a segment, their noise
   floors, and the loss by kind and parameter (kernel.py). */
typedef struct {
  const double *measured, *noise;
  int loss;
  double parameter;
} yardstick;

/* Where the comparison is summed over a segment: cost and, with sensitivities, gradient (NC) and the lower triangle of
   the Gauss-Newton Hessian (NC x NC, row major). */
typedef struct {
  double cost, *gradient, *square;
} score;

/* Grid, inputs and parameters of a segment; all pointers at its first node. */
typedef struct {
  long n;
  const double *dt;
  const long *substeps, *ticks;
  const double *u0, *u1, *un;
  const double *p, *width;
  const map *output;
} course;

/* out = a s + [0, b]: the chain rule of one map; a (rows x NX), b (rows x NA), s (NX x NC), column major. */
static inline void chain(int rows, const double *restrict a, const double *restrict b, const double *restrict s,
                         double *restrict out) {
  for (int c = 0; c < NC; ++c)
    for (int i = 0; i < rows; ++i) {
      double sum = c >= NX ? b[(c - NX) * rows + i] : 0.0;
      for (int j = 0; j < NX; ++j) sum += a[j * rows + i] * s[c * NX + j];
      out[c * rows + i] = sum;
    }
}

/* Solve for the unknown torques of a map from where they were last; work->arg holds the arguments. */
static void solve(const map *m, double *torques, work_space *work) {
  work->arg[5] = torques;
  work->arg[6] = work->res[0] = work->constants;
  m->constants(work->arg, work->res, work->iw, work->w, 0);
  work->res[0] = work->value;
  for (int k = 0; k < NEWTON_LIMIT; ++k) {
    double change = 0.0, size = 0.0;
    m->newton(work->arg, work->res, work->iw, work->w, 0);
    for (int i = 0; i < m->unknowns; ++i) {
      change = fmax(change, fabs(work->value[i] - torques[i]));
      size = fmax(size, fabs(work->value[i]));
      torques[i] = work->value[i];
    }
    if (!(change > NEWTON_TOLERANCE * size)) break;
  }
}

/* Put the value of a map into work->value and, with `derivatives`, its Jacobians into work->a and work->b. */
static void evaluate(const map *m, double *torques, int derivatives, work_space *work) {
  if (m->unknowns) solve(m, torques, work);
  work->res[0] = work->value;
  work->res[1] = work->a;
  work->res[2] = work->b;
  (derivatives ? m->derivative : m->value)(work->arg, work->res, work->iw, work->w, 0);
}

/* Advance state x (NX) and sensitivities s (NX x NC, or NULL) by a map; work->arg holds the arguments. */
static void advance(const map *m, double *x, double *s, work_space *work) {
  evaluate(m, work->step_torques, s != 0, work);
  memcpy(x, work->value, sizeof(double) * NX);
  if (s) {
    chain(NX, work->a, work->b, s, work->moved);
    memcpy(s, work->moved, sizeof(double) * NX * NC);
  }
}

static void step(const course *at, const double *u, double h, double *x, double *s, work_space *work) {
  const double **arg = work->arg;
  arg[0] = x, arg[1] = u, arg[2] = at->p, arg[3] = &h, arg[4] = at->width;
  advance(&STEP, x, s, work);
}

static void tick(const course *at, long k, double kind, double *x, double *s, work_space *work) {
#ifdef TICK
  const double **arg = work->arg;
  arg[0] = x, arg[1] = at->un + k * NU, arg[2] = at->p, arg[3] = &kind;
  advance(&TICK, x, s, work);
#endif
}

/* Cost rho(r) of a residual in noise floors; its weight rho'(r) / r goes to *weight. Sources: losses.py. */
static inline double cost_of(const yardstick *by, double r, double *weight) {
  double p = by->parameter, size = fabs(r);
  switch (by->loss) {
    case 1:
      size = sqrt(r * r + p * p);
      *weight = 1.0 / size;
      return size - p;
    case 2:
      *weight = size > p ? p / size : 1.0;
      return size > p ? p * (size - 0.5 * p) : 0.5 * r * r;
    case 3:
      *weight = (p + 1.0) / (p + r * r);
      return 0.5 * (p + 1.0) * log1p(r * r / p);
    default:
      *weight = 1.0;
      return 0.5 * r * r;
  }
}

/* Add the comparison of outputs y at node k; with `derivatives` their sensitivities are in work->moved (NY x NC,
   column major). */
static void compare(const yardstick *by, long k, const double *y, int derivatives, score *sum, work_space *work) {
  double v[NC + 1];
  for (int i = 0; i < NY; ++i) {
    double sample = by->measured[k * NY + i], weight;
    if (!isfinite(sample)) continue;
    double error = (y[i] - sample) / by->noise[i];
    sum->cost += cost_of(by, error, &weight);
    if (!derivatives) continue;
    for (int c = 0; c < NC; ++c) v[c] = work->moved[c * NY + i] / by->noise[i];
    for (int c = 0; c < NC; ++c) {
      double pull = weight * v[c], *row = sum->square + c * NC;
      sum->gradient[c] += pull * error;
      for (int d = 0; d <= c; ++d) row[d] += pull * v[d];
    }
  }
}

/* Write outputs y (NY) and, where s is given, their sensitivities to work->moved (NY x NC, column major) and, where dy
   is given, to dy (NY x NC, row major) at node k. */
static void observe(const course *at, long k, double h, const double *x, const double *s, double *y, double *dy,
                    work_space *work) {
  const double **arg = work->arg;
  int derivatives = s != 0;
  arg[0] = x, arg[1] = at->un + k * NU, arg[2] = at->p, arg[3] = &h, arg[4] = at->width;
  evaluate(at->output, work->output_torques, derivatives, work);
  memcpy(y, work->value, sizeof(double) * NY);
  if (!derivatives) return;
  chain(NY, work->a, work->b, s, work->moved);
  if (!dy) return;
  for (int i = 0; i < NY; ++i)
    for (int c = 0; c < NC; ++c) dy[i * NC + c] = work->moved[c * NY + i];
}

/* One segment: state x and sensitivities s (or NULL) advance in place; states (n x NX), y (n x NY) and dy
   (n x NY x NC), each of which may be NULL, are written at the nodes; where there is a yardstick, outputs are compared
   with it. The closing node is the next segment's first: only the last segment, which `closes`, ticks and writes it. */
static void segment(const course *at, double *x, double *s, double *states, double *y, double *dy,
                    const yardstick *by, score *sum, int closes) {
  work_space work;
  double u[NU + 1], h = at->dt[0] / (double)at->substeps[0];
  memset(work.step_torques, 0, sizeof work.step_torques);
  memset(work.output_torques, 0, sizeof work.output_torques);
  for (long k = 0; k < at->n; ++k) {
    int last = k == at->n - 1;
    if (last && !closes) return;
    if (at->ticks[k] & 2) tick(at, k, 2.0, x, s, &work);
    if (at->ticks[k] & 1) tick(at, k, 1.0, x, s, &work);
    if (at->dt[k] > 0.0) h = at->dt[k] / (double)at->substeps[k];
    if (states) memcpy(states + k * NX, x, sizeof(double) * NX);
    if (y && NY > 0) {
      observe(at, k, h, x, dy || by ? s : 0, y + k * NY, dy ? dy + k * NY * NC : 0, &work);
      if (by) compare(by, k, y + k * NY, s != 0, sum, &work);
    }
    if (last) return;
    for (long sub = 0; sub < at->substeps[k]; ++sub) {
      double share = (sub + 0.5) / (double)at->substeps[k];
      for (int i = 0; i < NU; ++i)
        u[i] = at->u0[k * NU + i] + share * (at->u1[k * NU + i] - at->u0[k * NU + i]);
      step(at, u, h, x, s, &work);
    }
  }
}

static const map *output_map(const double *p) {
#ifdef NOW
  int delayed = 0;
  for (unsigned i = 0; i < sizeof DELAYS / sizeof *DELAYS; ++i) delayed |= p[DELAYS[i]] != 0.0;
  if (!delayed) return &NOW;
#endif
  return &OUTPUT;
}

/* Segments one after the other: segment j covers nodes first[j] .. first[j + 1]; the last one `closes` the
   recording or not. Grid arrays, measured and y, dy, states begin at node 0 of the recording.
   x0 (segments x NX) -> end (segments x NX) and, with `derivatives`, dend (segments x NX x NC, column major).
   Where there is `measured`: cost (segments) and, with `derivatives`, gradient (segments x NC) and square (segments x
   NC x NC), zeros before. */
SWEEP_EXPORT void friction_ocp_sweep(long segments, int closes, const long *first, const double *dt,
                                     const long *substeps, const long *ticks, const double *u0, const double *u1,
                                     const double *un, const double *p, const double *width, const double *x0,
                                     const double *measured, const double *noise, int loss, double parameter,
                                     int derivatives, double *states, double *y, double *dy, double *end,
                                     double *dend, double *cost, double *gradient, double *square) {
  const map *output = output_map(p);
  for (long j = 0; j < segments; ++j) {
    long begin = first[j], count = first[j + 1] - begin + 1;
    course at = {count,           dt + begin,      substeps + begin, ticks + begin, u0 + begin * NU,
                 u1 + begin * NU, un + begin * NU, p,                width,         output};
    yardstick by = {measured ? measured + begin * NY : 0, noise, loss, parameter};
    score sum = {0.0, derivatives && measured ? gradient + j * NC : 0, derivatives && measured ? square + j * SQUARE : 0};
    double x[NX + 1], s[NX * NC + 1];
    memcpy(x, x0 + j * NX, sizeof(double) * NX);
    if (derivatives) {
      memset(s, 0, sizeof s);
      for (int i = 0; i < NX; ++i) s[i * NX + i] = 1.0;
    }
    segment(&at, x, derivatives ? s : 0, states ? states + begin * NX : 0, y ? y + begin * NY : 0,
            (derivatives && dy) ? dy + begin * NY * NC : 0, measured ? &by : 0, &sum, closes && j == segments - 1);
    memcpy(end + j * NX, x, sizeof(double) * NX);
    if (derivatives) memcpy(dend + j * NX * NC, s, sizeof(double) * NX * NC);
    if (!measured) continue;
    cost[j] = sum.cost;
    if (derivatives)
      for (int c = 0; c < NC; ++c)
        for (int d = 0; d < c; ++d) sum.square[d * NC + c] = sum.square[c * NC + d];
  }
}
