/* FMI 3.0: model exchange and co-simulation. */
#include "core.h"
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;
typedef void (*Logger)(void *environment, Status status, const char *category, const char *text);
typedef struct {
  Core *core;
  void *environment;
  Logger logger;
  bool early; /* whether a step may return before its end */
} FMU;
typedef struct {
  size_t size;
  uint8_t bytes[];
} Saved;
typedef uint32_t R;
#define CORE(c) (((FMU *)(c))->core)
#define RESULT(x) return (x) ? OK : ERROR
#define NOTHING(name, ...) \
  API Status fmi3##name(void *c, __VA_ARGS__) { return ERROR; }

static const Status status[SAYINGS] = { OK, ERROR, WARNING };
static const char *const category[SAYINGS] = { "logAll", "logStatusError", "logStatusWarning" };

static void say(void *owner, int level, const char *text) {
  FMU *f = owner;
  if (f->logger) f->logger(f->environment, status[level], category[level], text);
}

static char *path_of(const char *folder, const char *file) {
  if (!folder) folder = "";
  size_t n = strlen(folder);
  char *path = malloc(n + strlen(file) + 2);
  if (!path) return 0;
  strcpy(path, folder);
  if (n && folder[n - 1] != '/' && folder[n - 1] != '\\') strcat(path, "/");
  return strcat(path, file);
}

static void *instantiate(const char *token, const char *folder, void *environment, Logger logger) {
  FMU *f = calloc(1, sizeof *f);
  char *path = path_of(folder, "model.bin");
  if (f && path) {
    f->environment = environment;
    f->logger = logger;
    f->core = core_new(path, token, f, say);
  }
  free(path);
  if (f && f->core) return f;
  free(f);
  return NULL;
}

API const char *fmi3GetVersion(void) { return "3.0"; }
API Status fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[]) { return OK; }
API void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *folder, bool visible, bool logging,
                                       void *environment, Logger logger) {
  FMU *f = instantiate(token, folder, environment, logger);
  if (f) f->core->exchange = 1;
  return f;
}
API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *folder, bool visible, bool logging,
                                      bool events, bool early, const R needed[], size_t n, void *environment,
                                      Logger logger, void *update) {
  FMU *f = instantiate(token, folder, environment, logger);
  if (f) f->early = early;
  return f;
}
API void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *folder, bool visible,
                                            bool logging, void *environment, Logger logger, void *update, void *lock,
                                            void *unlock) { return NULL; }
API void fmi3FreeInstance(void *c) {
  if (!c) return;
  core_free(CORE(c));
  free(c);
}
API Status fmi3EnterInitializationMode(void *c, bool defined, double tolerance, double start, bool stops, double stop) {
  if (defined) core_tolerance(CORE(c), tolerance);
  core_time(CORE(c), start);
  return OK;
}
API Status fmi3ExitInitializationMode(void *c) { RESULT(core_initialise(CORE(c))); }
API Status fmi3EnterEventMode(void *c) { return OK; }
API Status fmi3Terminate(void *c) { return OK; }
API Status fmi3Reset(void *c) {
  core_reset(CORE(c));
  return OK;
}

API Status fmi3GetFloat64(void *c, const R r[], size_t n, double v[], size_t values) {
  for (size_t k = 0; k < n; k++)
    if (!core_get(CORE(c), r[k], v + k)) return ERROR;
  return OK;
}
API Status fmi3SetFloat64(void *c, const R r[], size_t n, const double v[], size_t values) {
  for (size_t k = 0; k < n; k++)
    if (!core_set(CORE(c), r[k], v[k])) return ERROR;
  return OK;
}
#define NONE(type, name)                                                                                             \
  API Status fmi3Get##name(void *c, const R r[], size_t n, type v[], size_t values) { return n ? ERROR : OK; }       \
  API Status fmi3Set##name(void *c, const R r[], size_t n, type const v[], size_t values) { return n ? ERROR : OK; }
NONE(float, Float32)
NONE(int8_t, Int8)
NONE(uint8_t, UInt8)
NONE(int16_t, Int16)
NONE(uint16_t, UInt16)
NONE(int32_t, Int32)
NONE(uint32_t, UInt32)
NONE(int64_t, Int64)
NONE(uint64_t, UInt64)
NONE(bool, Boolean)
NONE(const char *, String)
API Status fmi3GetBinary(void *c, const R r[], size_t n, size_t s[], const uint8_t *v[], size_t k) { return n ? ERROR : OK; }
API Status fmi3SetBinary(void *c, const R r[], size_t n, const size_t s[], const uint8_t *const v[], size_t k) { return n ? ERROR : OK; }
API Status fmi3GetClock(void *c, const R r[], size_t n, bool v[]) { return n ? ERROR : OK; }
API Status fmi3SetClock(void *c, const R r[], size_t n, const bool v[]) { return n ? ERROR : OK; }

API Status fmi3GetFMUState(void *c, void **state) {
  size_t size = core_saved_size(CORE(c));
  Saved *saved = *state ? *state : malloc(sizeof(Saved) + size);
  if (!saved) return ERROR;
  saved->size = size;
  core_save(CORE(c), (char *)saved->bytes);
  *state = saved;
  return OK;
}
API Status fmi3SetFMUState(void *c, void *state) { RESULT(core_restore(CORE(c), (char *)((Saved *)state)->bytes, ((Saved *)state)->size)); }
API Status fmi3FreeFMUState(void *c, void **state) {
  if (state) free(*state), *state = NULL;
  return OK;
}
API Status fmi3SerializedFMUStateSize(void *c, void *state, size_t *size) {
  *size = ((Saved *)state)->size;
  return OK;
}
API Status fmi3SerializeFMUState(void *c, void *state, uint8_t bytes[], size_t size) {
  if (size < ((Saved *)state)->size) return ERROR;
  memcpy(bytes, ((Saved *)state)->bytes, ((Saved *)state)->size);
  return OK;
}
API Status fmi3DeserializeFMUState(void *c, const uint8_t bytes[], size_t size, void **state) {
  Saved *saved = malloc(sizeof(Saved) + size);
  if (!saved) return ERROR;
  saved->size = size;
  memcpy(saved->bytes, bytes, size);
  *state = saved;
  return OK;
}

NOTHING(GetNumberOfVariableDependencies, R r, size_t *n)
NOTHING(GetVariableDependencies, R r, size_t e[], R i[], size_t f[], int kinds[], size_t n)
API Status fmi3GetDirectionalDerivative(void *c, const R u[], size_t nu, const R k[], size_t nk, const double s[], size_t ns,
                                        double d[], size_t nd) {
  RESULT(ns == nk && nd >= nu && core_directional(CORE(c), u, nu, k, nk, s, d));
}
API Status fmi3GetAdjointDerivative(void *c, const R u[], size_t nu, const R k[], size_t nk, const double s[], size_t ns,
                                    double d[], size_t nd) {
  if (ns != nu || nd < nk) return ERROR;
  double one = 1, *column = malloc(8 * nu + 8);
  int done = column != 0;
  for (size_t j = 0; done && j < nk; j++) {
    done = core_directional(CORE(c), u, nu, k + j, 1, &one, column);
    d[j] = 0;
    for (size_t i = 0; done && i < nu; i++) d[j] += s[i] * column[i];
  }
  free(column);
  RESULT(done);
}
NOTHING(GetIntervalDecimal, const R r[], size_t n, double v[], int q[])
NOTHING(GetIntervalFraction, const R r[], size_t n, uint64_t a[], uint64_t b[], int q[])
NOTHING(GetShiftDecimal, const R r[], size_t n, double v[])
NOTHING(GetShiftFraction, const R r[], size_t n, uint64_t a[], uint64_t b[])
NOTHING(SetIntervalDecimal, const R r[], size_t n, const double v[])
NOTHING(SetIntervalFraction, const R r[], size_t n, const uint64_t a[], const uint64_t b[])
NOTHING(SetShiftDecimal, const R r[], size_t n, const double v[])
NOTHING(SetShiftFraction, const R r[], size_t n, const uint64_t a[], const uint64_t b[])
NOTHING(GetOutputDerivatives, const R r[], size_t n, const int32_t order[], double v[], size_t values)
NOTHING(ActivateModelPartition, R clock, double t)
API Status fmi3EnterConfigurationMode(void *c) { return ERROR; }
API Status fmi3ExitConfigurationMode(void *c) { return ERROR; }

/* model exchange */
API Status fmi3EvaluateDiscreteStates(void *c) { return OK; }
API Status fmi3UpdateDiscreteStates(void *c, bool *again, bool *terminate, bool *nominals, bool *values, bool *defined, double *next) {
  core_next_stretch(CORE(c));
  double end = core_next_break(CORE(c));
  *again = *nominals = *values = false;
  *terminate = core_events(CORE(c));
  *defined = isfinite(end);
  *next = *defined ? end : 0;
  return OK;
}
API Status fmi3EnterContinuousTimeMode(void *c) { return OK; }
API Status fmi3CompletedIntegratorStep(void *c, bool no_return, bool *event, bool *terminate) {
  *event = *terminate = false;
  RESULT(core_completed(CORE(c)));
}
API Status fmi3SetTime(void *c, double t) {
  core_time(CORE(c), t);
  return OK;
}
API Status fmi3SetContinuousStates(void *c, const double x[], size_t n) {
  core_put_states(CORE(c), x);
  return OK;
}
API Status fmi3GetContinuousStates(void *c, double x[], size_t n) {
  core_get_states(CORE(c), x);
  return OK;
}
API Status fmi3GetContinuousStateDerivatives(void *c, double x[], size_t n) { RESULT(core_rates(CORE(c), x)); }
API Status fmi3GetEventIndicators(void *c, double z[], size_t n) { RESULT(core_indicators(CORE(c), z)); }
API Status fmi3GetNominalsOfContinuousStates(void *c, double x[], size_t n) {
  memcpy(x, CORE(c)->model.nominals, n * sizeof *x);
  return OK;
}
API Status fmi3GetNumberOfEventIndicators(void *c, size_t *n) {
  *n = (size_t)CORE(c)->model.head->indicators;
  return OK;
}
API Status fmi3GetNumberOfContinuousStates(void *c, size_t *n) {
  *n = (size_t)CORE(c)->model.head->states;
  return OK;
}

/* co-simulation */
API Status fmi3EnterStepMode(void *c) { return OK; }
API Status fmi3DoStep(void *c, double t, double h, bool no_return, bool *event, bool *terminate, bool *early, double *last) {
  *event = false;
  int done = core_step(CORE(c), t + h);
  *terminate = CORE(c)->ended;
  *early = *terminate && ((FMU *)c)->early;
  *last = CORE(c)->t;
  RESULT(done);
}
