/* Loop of the generated one-step functions over the samples of a segment, with forward sensitivities.
   The generated code and the sizes NX NU NP NA NY NW (states, inputs, parameters, active parameters,
   outputs, smoothing widths) stand above this text. NC = NX + NA columns: initial state, then parameters. */

#define NC (NX + NA)

static void matmul_add(const double *a, const double *s, const double *b, double *out) {
  for (int c = 0; c < NC; ++c)
    for (int i = 0; i < NX; ++i) {
      double sum = (b && c >= NX) ? b[(c - NX) * NX + i] : 0.0;
      for (int j = 0; j < NX; ++j) sum += a[j * NX + i] * s[c * NX + j];
      out[c * NX + i] = sum;
    }
}

static void tick_once(double kind, double *x, double *s, const double *u, const double *p) {
#ifdef HAS_TICK
  double next[NX], a[NX * NX], b[NX * NA + 1], moved[NX * NC];
  double *work = (double *)__builtin_alloca(sizeof(double) * (TICK_W + 1));
  casadi_int *iwork = (casadi_int *)__builtin_alloca(sizeof(casadi_int) * (TICK_IW + 1));
  const double *arg[TICK_ARG + 4] = {x, u, p, &kind};
  double *res[TICK_RES + 3] = {next, s ? a : 0, s ? b : 0};
  fo_tick(arg, res, iwork, work, 0);
  memcpy(x, next, sizeof next);
  if (s) {
    matmul_add(a, s, b, moved);
    memcpy(s, moved, sizeof moved);
  }
#endif
}

/* One segment: states x (NX) and sensitivities s (NX x NC, column major, or NULL) advance in place.
   states (n x NX), y (n x NY) and dy (n x NY x NC) are written at the nodes; each may be NULL.
   node inputs un (n x NU); interval inputs u0, u1 (n x NU, the last row unused). */
static void segment(long n, const double *dt, const long *substeps, const long *ticks, const double *u0,
                    const double *u1, const double *un, const double *p, const double *width, double *x, double *s,
                    double *states, double *y, double *dy, double *last_h, int closes) {
  double work[STEP_W + OUT_W + 1];
  casadi_int iwork[STEP_IW + OUT_IW + 1];
  double next[NX], a[NX * NX], b[NX * NA + 1], moved[NX * NC], c[NY * NX + 1], d[NY * NA + 1], u[NU + 1];
  for (long k = 0; k < n; ++k) {
    int last = k == n - 1;
    /* the closing node belongs to the next segment, which ticks it */
    if (!(last && !closes)) {
      if (ticks[k] & 2) tick_once(2.0, x, s, un + k * NU, p);
      if (ticks[k] & 1) tick_once(1.0, x, s, un + k * NU, p);
    }
    double h = (dt[k] > 0.0) ? dt[k] / (double)substeps[k] : *last_h;
    if (states) memcpy(states + k * NX, x, sizeof(double) * NX);
    if (y && NY > 0) {
      const double *arg[OUT_ARG + 5] = {x, un + k * NU, p, &h, width};
      double *res[OUT_RES + 3] = {y + k * NY, (s && dy) ? c : 0, (s && dy) ? d : 0};
      fo_output(arg, res, iwork, work, 0);
      if (s && dy)
        for (int col = 0; col < NC; ++col)
          for (int i = 0; i < NY; ++i) {
            double sum = col >= NX ? d[(col - NX) * NY + i] : 0.0;
            for (int j = 0; j < NX; ++j) sum += c[j * NY + i] * s[col * NX + j];
            dy[(k * NY + i) * NC + col] = sum;
          }
    }
    if (last) break;
    *last_h = h;
    for (long sub = 0; sub < substeps[k]; ++sub) {
      double share = (sub + 0.5) / (double)substeps[k];
      for (int i = 0; i < NU; ++i) u[i] = u0[k * NU + i] + share * (u1[k * NU + i] - u0[k * NU + i]);
      const double *arg[STEP_ARG + 5] = {x, u, p, &h, width};
      double *res[STEP_RES + 3] = {next, s ? a : 0, s ? b : 0};
      fo_step(arg, res, iwork, work, 0);
      memcpy(x, next, sizeof next);
      if (s) {
        matmul_add(a, s, b, moved);
        memcpy(s, moved, sizeof moved);
      }
    }
  }
}

/* All segments: segment j covers nodes first[j] .. first[j + 1] (the closing node included, for continuity).
   x0 (segments x NX) -> end (segments x NX) and dend (segments x NX x NC, column major). */
SWEEP_EXPORT void friction_ocp_sweep(long segments, const long *first, const double *dt, const long *substeps,
                                     const long *ticks, const double *u0, const double *u1, const double *un,
                                     const double *p, const double *width, const double *x0, int derivatives,
                                     double *states, double *y, double *dy, double *end, double *dend) {
  for (long j = 0; j < segments; ++j) {
    long begin = first[j], count = first[j + 1] - begin + 1;
    double x[NX], s[NX * NC], last_h = dt[begin] / (double)substeps[begin];
    memcpy(x, x0 + j * NX, sizeof x);
    if (derivatives) {
      memset(s, 0, sizeof s);
      for (int i = 0; i < NX; ++i) s[i * NX + i] = 1.0;
    }
    segment(count, dt + begin, substeps + begin, ticks + begin, u0 + begin * NU, u1 + begin * NU, un + begin * NU, p,
            width, x, derivatives ? s : 0, states ? states + begin * NX : 0, y ? y + begin * NY : 0,
            (derivatives && dy) ? dy + begin * NY * NC : 0, &last_h, j == segments - 1);
    memcpy(end + j * NX, x, sizeof x);
    if (derivatives) memcpy(dend + j * NX * NC, s, sizeof s);
  }
}
