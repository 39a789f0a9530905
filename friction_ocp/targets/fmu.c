/* FMI 2.0 co-simulation around the generated model. Above this text stand the model, whose functions are called
   through the macros MODEL_STEP, MODEL_OUTPUT and, for a sampled controller, MODEL_TICK, its sizes NX NU NY NP,
   MAX_STEP, IDENTIFIED, GUID and, with MODEL_TICK, SAMPLE_TIME and DELAY.
   Value references: inputs 1000 + k, outputs 2000 + k, numbers 3000 + k, start states 4000 + k, states 5000 + k;
   6000 says that a sampled controller has acted at the start already. A step of length 0 lets it act when it is due. */

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32
#define FMI_EXPORT __declspec(dllexport)
#else
#define FMI_EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef int fmi2StatusKind;
typedef struct {
  void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
  double x[NX + 1], start[NX + 1], u[NU + 1], du[NU + 1], p[NP + 1];
  double begin, time, h, acted;
  long ticks, applied;
} instance;

static void restart(instance *one) {
  memset(one, 0, sizeof *one);
  memcpy(one->p, IDENTIFIED, sizeof(double) * NP);
  one->h = MAX_STEP;
}

static void inputs_at(const instance *one, double since, double *u) {
  for (int k = 0; k < NU; ++k) u[k] = one->u[k] + since * one->du[k];
}

#ifdef MODEL_TICK
static double next_event(const instance *one) {
  double compute = one->begin + (double)one->ticks * SAMPLE_TIME;
  double apply = one->begin + (double)one->applied * SAMPLE_TIME + DELAY;
  return DELAY > 0.0 && apply < compute ? apply : compute;
}

/* Let the controller do what is due at `time`: a delayed command is applied before the next one is computed. */
static void tick(instance *one, double time, const double *u) {
  double near = 1e-9 * SAMPLE_TIME;
  if (DELAY > 0.0 && one->begin + (double)one->applied * SAMPLE_TIME + DELAY <= time + near) {
    MODEL_TICK(one->x, u, one->p, 2);
    ++one->applied;
  }
  if (one->begin + (double)one->ticks * SAMPLE_TIME <= time + near) {
    MODEL_TICK(one->x, u, one->p, 1);
    ++one->ticks;
  }
}
#endif

static void advance(instance *one, double from, double length) {
  double u[NU + 1], done = 0.0;
#ifdef MODEL_TICK
  inputs_at(one, 0.0, u);
  tick(one, from, u);
#endif
  while (done < length * (1.0 - 1e-12)) {
    double piece = length - done;
#ifdef MODEL_TICK
    inputs_at(one, done, u);
    tick(one, from + done, u);
    if (next_event(one) - (from + done) < piece) piece = next_event(one) - (from + done);
#endif
    int steps = (int)ceil(piece / MAX_STEP - 1e-9);
    if (steps < 1) steps = 1;
    one->h = piece / steps;
    for (int k = 0; k < steps; ++k) {
      inputs_at(one, done + (k + 0.5) * one->h, u);
      MODEL_STEP(one->x, u, one->p, one->h);
    }
    done += piece;
  }
  one->time = from + length;
}

FMI_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMI_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
  (void)c, (void)on, (void)n, (void)names;
  return fmi2OK;
}

FMI_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                         const fmi2CallbackFunctions *call, fmi2Boolean visible, fmi2Boolean log) {
  (void)name, (void)resources, (void)call, (void)visible, (void)log;
  if (type != fmi2CoSimulation || strcmp(guid, GUID)) return NULL;
  instance *one = malloc(sizeof *one);
  if (one) restart(one);
  return one;
}

FMI_EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

FMI_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean limited, fmi2Real tolerance, fmi2Real start,
                                          fmi2Boolean ends, fmi2Real stop) {
  (void)limited, (void)tolerance, (void)ends, (void)stop;
  ((instance *)c)->begin = ((instance *)c)->time = start;
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return c ? fmi2OK : fmi2Error; }

FMI_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  instance *one = c;
  memcpy(one->x, one->start, sizeof(double) * NX);
#ifdef MODEL_TICK
  if (one->acted > 0.5) one->ticks = 1;
  tick(one, one->time, one->u);
#endif
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return c ? fmi2OK : fmi2Error; }

FMI_EXPORT fmi2Status fmi2Reset(fmi2Component c) {
  restart(c);
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  instance *one = c;
  double y[NY + 1];
  MODEL_OUTPUT(one->x, one->u, one->p, one->h, y);
  for (size_t i = 0; i < n; ++i) {
    unsigned k = vr[i] % 1000;
    switch (vr[i] / 1000) {
    case 1: if (k >= NU) return fmi2Error; value[i] = one->u[k]; break;
    case 2: if (k >= NY) return fmi2Error; value[i] = y[k]; break;
    case 3: if (k >= NP) return fmi2Error; value[i] = one->p[k]; break;
    case 4: if (k >= NX) return fmi2Error; value[i] = one->start[k]; break;
    case 5: if (k >= NX) return fmi2Error; value[i] = one->x[k]; break;
    case 6: value[i] = one->acted; break;
    default: return fmi2Error;
    }
  }
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  instance *one = c;
  for (size_t i = 0; i < n; ++i) {
    unsigned k = vr[i] % 1000;
    switch (vr[i] / 1000) {
    case 1: if (k >= NU) return fmi2Error; one->u[k] = value[i]; break;
    case 3: if (k >= NP) return fmi2Error; one->p[k] = value[i]; break;
    case 4: if (k >= NX) return fmi2Error; one->start[k] = value[i]; break;
    case 6: one->acted = value[i]; break;
    default: return fmi2Error;
    }
  }
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                  const fmi2Integer order[], const fmi2Real value[]) {
  instance *one = c;
  for (size_t i = 0; i < n; ++i) {
    if (order[i] != 1 || vr[i] / 1000 != 1 || vr[i] % 1000 >= NU) return fmi2Error;
    one->du[vr[i] % 1000] = value[i];
  }
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real length, fmi2Boolean no_return) {
  (void)no_return;
  instance *one = c;
  if (!(length >= 0.0) || length > 1e6) return fmi2Error;
  advance(one, now, length);
  memset(one->du, 0, sizeof one->du);
  for (int k = 0; k < NX; ++k)
    if (!isfinite(one->x[k])) return fmi2Error;
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

#define NONE_OF(kind, type, access)                                                                                  \
  FMI_EXPORT fmi2Status fmi2##kind(fmi2Component c, const fmi2ValueReference vr[], size_t n, access type v[]) {      \
    (void)c, (void)vr, (void)v;                                                                                      \
    return n ? fmi2Error : fmi2OK;                                                                                   \
  }
NONE_OF(GetInteger, fmi2Integer, )
NONE_OF(SetInteger, fmi2Integer, const)
NONE_OF(GetBoolean, fmi2Boolean, )
NONE_OF(SetBoolean, fmi2Boolean, const)
NONE_OF(GetString, fmi2String, )
NONE_OF(SetString, fmi2String, const)

FMI_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                   const fmi2Integer order[], fmi2Real value[]) {
  (void)c, (void)vr, (void)order, (void)value;
  return n ? fmi2Error : fmi2OK;
}

/* The whole state of an instance is one block of memory. */
FMI_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  if (!*state) *state = malloc(sizeof(instance));
  if (!*state) return fmi2Error;
  memcpy(*state, c, sizeof(instance));
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  memcpy(c, state, sizeof(instance));
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  free(*state);
  *state = NULL;
  return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
  (void)c, (void)state, (void)size;
  return fmi2Error;
}

FMI_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  (void)c, (void)state, (void)bytes, (void)size;
  return fmi2Error;
}

FMI_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t n, fmi2FMUstate *s) {
  (void)c, (void)bytes, (void)n, (void)s;
  return fmi2Error;
}

FMI_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu,
                                                   const fmi2ValueReference k[], size_t nk, const fmi2Real du[],
                                                   fmi2Real dk[]) {
  (void)c, (void)u, (void)nu, (void)k, (void)nk, (void)du, (void)dk;
  return fmi2Error;
}

#define NO_STATUS(kind, type)                                                                                        \
  FMI_EXPORT fmi2Status fmi2Get##kind(fmi2Component c, const fmi2StatusKind s, type *value) {                        \
    (void)c, (void)s, (void)value;                                                                                   \
    return fmi2Discard;                                                                                              \
  }
NO_STATUS(Status, fmi2Status)
NO_STATUS(RealStatus, fmi2Real)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(BooleanStatus, fmi2Boolean)
NO_STATUS(StringStatus, fmi2String)
