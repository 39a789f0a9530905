/* Loop of the generated maps of a drive over the samples of segments, with forward sensitivities, LANES segments at
   once (lanes.h).

   Above this text stand lanes.h, the code of the maps (lane_code.py, from maps.py) and the sizes
     NX NU NP NW NA NY         states, inputs, parameters, widths, active parameters, outputs;
     NC                        most columns of sensitivities: the state at the segment's start, then the active
                               parameters; a sweep has none of them, the first NX or all;
     NL NK                     most unknown torques, and constants of their equations, of any map;
   then a table of the maps (STEP, OUTPUT and, where there are any, TICK and NOW) and the list DELAYS of the
   parameters that must be 0 for NOW to replace OUTPUT.
   Each map has the functions of maps.py: for unknown torques, if any, the constants of their equations and one step
   of Newton's method; the value; the value with the nonzeros of its Jacobians by state and by active parameters; and
   what multiplies these with sensitivities.
   Nothing here is static: calls from several threads at once are safe. */

#define NEWTON_LIMIT 15
#define NEWTON_TOLERANCE 1e-8 /* of the last correction; Newton's method squares it */

/* One segment: its grid, inputs, parameters and start; what it is compared with; where its results go. Pointers are at
   its first node. The closing node is the next segment's first: only the last segment, which `closes` its recording,
   ticks and writes it.
   resets (n x NX, states from a node on, NaN where they go on) may be NULL.
   Samples (n x NY, NaN where there is none), noise floors and the loss, its kind and parameter (kernel.py), or NULL.
   course (n x NX, states before the ticks of a node), states (n x NX, after them), y (n x NY) and dy (n x NY x columns)
   may be NULL; end (NX), dend (NX x columns, column major) with sensitivities; cost, gradient (columns) and square
   (columns x columns) where there is something to compare with. */
typedef struct {
  long n, closes;
  const double *dt;
  const long *substeps, *ticks;
  const double *u0, *u1, *un;
  const double *p, *width, *x0, *resets;
  const double *measured, *noise, *loss;
  double *course, *states, *y, *dy, *end, *dend, *cost, *gradient, *square;
} segment;

/* Segments side by side: lane i belongs to at[i]; lanes from `live` on repeat the first. */
typedef struct {
  const segment *at[LANES];
  const map *output;
  int live, columns; /* columns of sensitivities; 0 without derivatives */
  mask writing; /* lanes that write the node that they are at */
  lanes x[NX + 1], u[NU + 1], held[NU + 1], p[NP + 1], width[NW + 1], h;
  lanes step_torques[NL + 1], output_torques[NL + 1];
  lanes cost, gradient[NC + 1], square[NC * NC + 1];
  const lanes *arg[7];
  lanes *res[3];
  lanes value[NX + NY + NL], a[(NX + NY) * NX + 1], b[(NX + NY) * NA + 1], constants[NK + 1];
  lanes sensitivities[2][(NX + NY) * NC + 1], *s, *moved; /* those of the state, and what a map makes of them */
} group;

/* Solve for the unknown torques of a map in some lanes from where they were last; now->arg holds the arguments. */
static void solve(const map *m, mask searching, lanes *torques, group *now) {
  now->arg[5] = torques;
  now->arg[6] = now->res[0] = now->constants;
  m->constants(now->arg, now->res, now->live);
  now->res[0] = now->value;
  for (int k = 0; k < NEWTON_LIMIT && any(searching); ++k) {
    lanes change = splat(0.0), size = splat(0.0);
    m->newton(now->arg, now->res, now->live);
    for (int i = 0; i < m->unknowns; ++i) {
      change = lanes_fmax(change, lanes_fabs(now->value[i] - torques[i]));
      size = lanes_fmax(size, lanes_fabs(now->value[i]));
      torques[i] = blend(searching, now->value[i], torques[i]);
    }
    searching &= (mask)(change > NEWTON_TOLERANCE * size);
  }
}

/* Put the value of a map, meant for some lanes, into now->value and, with `derivatives`, its Jacobians into now->a and
   now->b. */
static void evaluate(const map *m, mask some, lanes *torques, int derivatives, group *now) {
  if (m->unknowns) solve(m, some, torques, now);
  now->res[0] = now->value;
  (derivatives ? m->derivative : m->value)(now->arg, now->res, now->live);
}

/* Advance states and sensitivities of some lanes by a map under inputs; now->arg holds its other arguments. */
static void advance(const map *m, mask some, const lanes *inputs, group *now) {
  int all = !any(~some);
  now->arg[1] = inputs;
  evaluate(m, some, now->step_torques, now->columns, now);
  if (now->columns) {
    lanes *before = now->s;
    m->chain(now->a, now->b, before, now->moved, now->columns);
    for (int i = 0; i < NX * now->columns && !all; ++i) now->moved[i] = blend(some, now->moved[i], before[i]);
    now->s = now->moved, now->moved = before;
  }
  for (int i = 0; i < NX; ++i) now->x[i] = all ? now->value[i] : blend(some, now->value[i], now->x[i]);
}

/* A row of a table (n x columns) of each segment, at its node k or its last. */
static inline long row_of(const segment *at, long k) { return k < at->n ? k : at->n - 1; }

/* Come to node k: note where the lanes are, and set what begins anew there, its inputs and which lanes write it, the
   closing node only where the segment closes the recording. */
static void arrive(long k, group *now) {
  for (int i = 0; i < LANES; ++i) {
    const segment *at = now->at[i];
    long row = row_of(at, k);
    now->writing[i] = -(long long)(k + !at->closes < at->n);
    for (int j = 0; j < NU; ++j) now->held[j][i] = at->un[row * NU + j];
    if (i >= now->live || k >= at->n) continue;
    for (int j = 0; j < NX && at->course; ++j) at->course[k * NX + j] = now->x[j][i];
    for (int j = 0; j < NX && at->resets; ++j)
      if (!isnan(at->resets[k * NX + j])) now->x[j][i] = at->resets[k * NX + j];
  }
}

/* Tick the lanes whose node k has this bit. */
static void tick(long k, long bit, group *now) {
#ifdef TICK
  lanes kind = splat((double)bit);
  mask some = now->writing;
  for (int i = 0; i < LANES; ++i)
    if (!(now->at[i]->ticks[row_of(now->at[i], k)] & bit)) some[i] = 0;
  if (!any(some)) return;
  now->arg[3] = &kind;
  advance(&TICK, some, now->held, now);
  now->arg[3] = &now->h;
#endif
}

/* Cost rho(r) of a residual in noise floors; its weight rho'(r) / r goes to *weight. Sources: losses.py. */
static inline double cost_of(const double *loss, double r, double *weight) {
  double p = loss[1], size = fabs(r);
  switch ((int)loss[0]) {
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

/* Compare output i at node k; with derivatives its sensitivities are in now->moved (NY x columns, column major). */
static void compare(long k, int i, group *now) {
  lanes weight = splat(0.0), error = splat(0.0), scale = splat(0.0), v[NC + 1];
  int compared = 0;
  for (int lane = 0; lane < now->live; ++lane) {
    const segment *at = now->at[lane];
    double sample = now->writing[lane] ? at->measured[k * NY + i] : NAN, how_much;
    if (!isfinite(sample)) continue;
    compared = 1;
    scale[lane] = 1.0 / at->noise[i];
    error[lane] = (now->value[i][lane] - sample) / at->noise[i];
    now->cost[lane] += cost_of(at->loss, error[lane], &how_much);
    weight[lane] = how_much;
  }
  if (!compared || !now->columns) return;
  for (int c = 0; c < now->columns; ++c) v[c] = pick((mask)(scale != 0.0), now->moved[c * NY + i] * scale);
  for (int c = 0; c < now->columns; ++c) {
    lanes pull = weight * v[c], *row = now->square + c * NC;
    now->gradient[c] += pull * error;
    for (int d = 0; d <= c; ++d) row[d] += pull * v[d];
  }
}

/* Write or compare what is seen at node k. */
static void observe(long k, group *now) {
  const segment *first = now->at[0];
  int columns = now->columns, derivatives = columns && (first->dy || first->measured);
  for (int i = 0; i < now->live; ++i)
    if (now->writing[i] && now->at[i]->states)
      for (int j = 0; j < NX; ++j) now->at[i]->states[k * NX + j] = now->x[j][i];
  if (!first->y || NY == 0) return;
  now->arg[1] = now->held;
  evaluate(now->output, now->writing, now->output_torques, derivatives, now);
  if (derivatives) now->output->chain(now->a, now->b, now->s, now->moved, columns);
  for (int i = 0; i < now->live; ++i) {
    const segment *at = now->at[i];
    if (!now->writing[i]) continue;
    for (int j = 0; j < NY; ++j) at->y[k * NY + j] = now->value[j][i];
    if (derivatives && at->dy)
      for (int j = 0; j < NY; ++j)
        for (int c = 0; c < columns; ++c) at->dy[(k * NY + j) * columns + c] = now->moved[c * NY + j][i];
  }
  if (first->measured)
    for (int i = 0; i < NY; ++i) compare(k, i, now);
}

/* Advance all lanes through interval k, each by its own steps. */
static void cross(long k, group *now) {
  long most = 0;
  for (int i = 0; i < now->live; ++i)
    if (k + 1 < now->at[i]->n && now->at[i]->substeps[k] > most) most = now->at[i]->substeps[k];
  for (long sub = 0; sub < most; ++sub) {
    mask some = {0};
    for (int i = 0; i < LANES; ++i) {
      const segment *at = now->at[i];
      long row = row_of(at, k);
      double share = (sub + 0.5) / (double)at->substeps[row];
      some[i] = -(long long)(k + 1 < at->n && sub < at->substeps[row]);
      for (int j = 0; j < NU; ++j)
        now->u[j][i] = at->u0[row * NU + j] + share * (at->u1[row * NU + j] - at->u0[row * NU + j]);
    }
    advance(&STEP, some, now->u, now);
  }
}

static void begin(group *now) {
  now->arg[0] = now->x, now->arg[2] = now->p, now->arg[3] = &now->h, now->arg[4] = now->width;
  now->res[1] = now->a, now->res[2] = now->b;
  for (int i = 0; i < LANES; ++i) {
    const segment *at = now->at[i];
    for (int j = 0; j < NX; ++j) now->x[j][i] = at->x0[j];
    for (int j = 0; j < NP; ++j) now->p[j][i] = at->p[j];
    for (int j = 0; j < NW; ++j) now->width[j][i] = at->width[j];
    now->h[i] = at->dt[0] / (double)at->substeps[0];
  }
  memset(now->step_torques, 0, sizeof now->step_torques);
  memset(now->output_torques, 0, sizeof now->output_torques);
  now->cost = splat(0.0);
  if (!now->columns) return;
  now->s = now->sensitivities[0], now->moved = now->sensitivities[1];
  memset(now->s, 0, sizeof now->sensitivities[0]);
  for (int i = 0; i < NX; ++i) now->s[i * NX + i] = splat(1.0);
  memset(now->gradient, 0, sizeof now->gradient);
  memset(now->square, 0, sizeof now->square);
}

static void finish(const group *now) {
  int columns = now->columns;
  for (int i = 0; i < now->live; ++i) {
    const segment *at = now->at[i];
    for (int j = 0; j < NX; ++j) at->end[j] = now->x[j][i];
    if (columns)
      for (int j = 0; j < NX * columns; ++j) at->dend[j] = now->s[j][i];
    if (!at->measured) continue;
    *at->cost = now->cost[i];
    for (int c = 0; c < columns; ++c) {
      at->gradient[c] = now->gradient[c][i];
      for (int d = 0; d <= c; ++d) at->square[c * columns + d] = at->square[d * columns + c] = now->square[c * NC + d][i];
    }
  }
}

static void simulate(group *now) {
  long nodes = 0;
  begin(now);
  for (int i = 0; i < now->live; ++i)
    if (now->at[i]->n > nodes) nodes = now->at[i]->n;
  for (long k = 0; k < nodes; ++k) {
    arrive(k, now);
    tick(k, 2, now);
    tick(k, 1, now);
    for (int i = 0; i < LANES; ++i)
      if (k < now->at[i]->n && now->at[i]->dt[k] > 0.0) now->h[i] = now->at[i]->dt[k] / (double)now->at[i]->substeps[k];
    observe(k, now);
    cross(k, now);
  }
  finish(now);
}

static const map *output_map(const double *p) {
#ifdef NOW
  int delayed = 0;
  for (unsigned i = 0; i < sizeof DELAYS / sizeof *DELAYS; ++i) delayed |= p[DELAYS[i]] != 0.0;
  if (!delayed) return &NOW;
#endif
  return &OUTPUT;
}

#define SWEEP_EXPORT __attribute__((visibility("default")))

SWEEP_EXPORT int friction_ocp_lanes(void) { return LANES; }

/* Simulate segments, those that stand beside each other side by side: the more alike their lengths, the better. All of
   them have the same NULLs. `columns` of sensitivities: 0, NX or NC. */
SWEEP_EXPORT void friction_ocp_sweep(long count, const segment *segments, int columns) {
  for (long done = 0; done < count;) {
    group now;
    now.columns = columns;
    now.output = output_map(segments[done].p);
    for (now.live = 0; now.live < LANES && done + now.live < count; ++now.live) {
      if (output_map(segments[done + now.live].p) != now.output) break;
      now.at[now.live] = segments + done + now.live;
    }
    for (int i = now.live; i < LANES; ++i) now.at[i] = now.at[0];
    done += now.live;
    simulate(&now);
  }
}
