/* Loop of the generated one-step functions over the samples of a segment, with forward sensitivities.

   Above this text stand the code that CasADi generated and the sizes
     NX NU NP NA NY            states, inputs, parameters, active parameters, outputs;
     SZ_ARG SZ_RES SZ_IW SZ_W  work space that suffices for every generated function;
     HAS_TICK                  where the drive has a sampled controller.
   fo_step, fo_output and fo_tick give values; fo_step_d, fo_output_d and fo_tick_d give the value and its
   Jacobians by state and by active parameters, column major.
   Sensitivities have NC = NX + NA columns: the state at the segment's start, then the active parameters.
   Nothing is static: calls from several threads at once are safe. */

#define NC (NX + NA)

typedef struct {
  double w[SZ_W];
  casadi_int iw[SZ_IW];
  const double *arg[SZ_ARG];
  double *res[SZ_RES];
} work_space;

/* Grid, inputs and parameters of a segment; all pointers at its first node. */
typedef struct {
  long n;
  const double *dt;
  const long *substeps, *ticks;
  const double *u0, *u1, *un;
  const double *p, *width;
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

static inline void pass_on(const double *a, const double *b, double *s) {
  double moved[NX * NC + 1];
  chain(NX, a, b, s, moved);
  memcpy(s, moved, sizeof(double) * NX * NC);
}

static void step_once(const course *at, const double *u, double h, double *x, double *s, work_space *work) {
  double next[NX + 1], a[NX * NX + 1], b[NX * NA + 1];
  const double **arg = work->arg;
  arg[0] = x, arg[1] = u, arg[2] = at->p, arg[3] = &h, arg[4] = at->width;
  work->res[0] = next, work->res[1] = a, work->res[2] = b;
  if (s) {
    fo_step_d(arg, work->res, work->iw, work->w, 0);
    pass_on(a, b, s);
  } else {
    fo_step(arg, work->res, work->iw, work->w, 0);
  }
  memcpy(x, next, sizeof(double) * NX);
}

static void tick_once(const course *at, long k, double kind, double *x, double *s, work_space *work) {
#ifdef HAS_TICK
  double next[NX + 1], a[NX * NX + 1], b[NX * NA + 1];
  const double **arg = work->arg;
  arg[0] = x, arg[1] = at->un + k * NU, arg[2] = at->p, arg[3] = &kind;
  work->res[0] = next, work->res[1] = a, work->res[2] = b;
  if (s) {
    fo_tick_d(arg, work->res, work->iw, work->w, 0);
    pass_on(a, b, s);
  } else {
    fo_tick(arg, work->res, work->iw, work->w, 0);
  }
  memcpy(x, next, sizeof(double) * NX);
#endif
}

/* Outputs y (NY) and, where s and dy are given, dy (NY x NC, row major) at node k. */
static void observe(const course *at, long k, double h, const double *x, const double *s, double *y, double *dy,
                    work_space *work) {
  double c[NY * NX + 1], d[NY * NA + 1], columns[NY * NC + 1];
  const double **arg = work->arg;
  arg[0] = x, arg[1] = at->un + k * NU, arg[2] = at->p, arg[3] = &h, arg[4] = at->width;
  work->res[0] = y, work->res[1] = c, work->res[2] = d;
  if (!(s && dy)) {
    fo_output(arg, work->res, work->iw, work->w, 0);
    return;
  }
  fo_output_d(arg, work->res, work->iw, work->w, 0);
  chain(NY, c, d, s, columns);
  for (int i = 0; i < NY; ++i)
    for (int col = 0; col < NC; ++col) dy[i * NC + col] = columns[col * NY + i];
}

/* One segment: state x (NX) and sensitivities s (NX x NC, or NULL) advance in place; states (n x NX), y (n x NY)
   and dy (n x NY x NC), each of which may be NULL, are written at the nodes. The closing node is the next
   segment's first: only the last segment, which `closes`, ticks and writes it. */
static void segment(const course *at, double *x, double *s, double *states, double *y, double *dy, int closes) {
  work_space work;
  double u[NU + 1], h = at->dt[0] / (double)at->substeps[0];
  for (long k = 0; k < at->n; ++k) {
    int last = k == at->n - 1;
    if (last && !closes) return;
    if (at->ticks[k] & 2) tick_once(at, k, 2.0, x, s, &work);
    if (at->ticks[k] & 1) tick_once(at, k, 1.0, x, s, &work);
    if (at->dt[k] > 0.0) h = at->dt[k] / (double)at->substeps[k];
    if (states) memcpy(states + k * NX, x, sizeof(double) * NX);
    if (y && NY > 0) observe(at, k, h, x, s, y + k * NY, dy ? dy + k * NY * NC : 0, &work);
    if (last) return;
    for (long sub = 0; sub < at->substeps[k]; ++sub) {
      double share = (sub + 0.5) / (double)at->substeps[k];
      for (int i = 0; i < NU; ++i)
        u[i] = at->u0[k * NU + i] + share * (at->u1[k * NU + i] - at->u0[k * NU + i]);
      step_once(at, u, h, x, s, &work);
    }
  }
}

/* All segments: segment j covers nodes first[j] .. first[j + 1] (the closing node included, for continuity).
   x0 (segments x NX) -> end (segments x NX) and, with `derivatives`, dend (segments x NX x NC, column major). */
SWEEP_EXPORT void friction_ocp_sweep(long segments, const long *first, const double *dt, const long *substeps,
                                     const long *ticks, const double *u0, const double *u1, const double *un,
                                     const double *p, const double *width, const double *x0, int derivatives,
                                     double *states, double *y, double *dy, double *end, double *dend) {
  for (long j = 0; j < segments; ++j) {
    long begin = first[j], count = first[j + 1] - begin + 1;
    course at = {count,           dt + begin,      substeps + begin, ticks + begin, u0 + begin * NU,
                 u1 + begin * NU, un + begin * NU, p,                width};
    double x[NX + 1], s[NX * NC + 1];
    memcpy(x, x0 + j * NX, sizeof(double) * NX);
    if (derivatives) {
      memset(s, 0, sizeof s);
      for (int i = 0; i < NX; ++i) s[i * NX + i] = 1.0;
    }
    segment(&at, x, derivatives ? s : 0, states ? states + begin * NX : 0, y ? y + begin * NY : 0,
            (derivatives && dy) ? dy + begin * NY * NC : 0, j == segments - 1);
    memcpy(end + j * NX, x, sizeof(double) * NX);
    if (derivatives) memcpy(dend + j * NX * NC, s, sizeof(double) * NX * NC);
  }
}
