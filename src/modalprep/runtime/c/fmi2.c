/* FMI 2.0: model exchange and co-simulation. */
#include "core.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } Status;
typedef enum { MODEL_EXCHANGE, CO_SIMULATION } Type;
typedef void (*Logger)(void *environment, const char *name, Status status, const char *category, const char *text, ...);
typedef struct {
  Logger logger;
  void *(*allocate)(size_t, size_t);
  void (*release)(void *);
  void (*finished)(void *, Status);
  void *environment;
} Callbacks;
typedef struct {
  int again, terminate, nominals, values, defined;
  double next;
} EventInfo;
typedef struct {
  Core *core;
  char *name;
  Callbacks callbacks;
} FMU;
typedef struct {
  size_t size;
  char bytes[];
} Saved;
#define CORE(c) (((FMU *)(c))->core)
#define RESULT(x) return (x) ? OK : ERROR

static const Status status[SAYINGS] = { OK, ERROR, WARNING };
static const char *const category[SAYINGS] = { "logAll", "logStatusError", "logStatusWarning" };

static void say(void *owner, int level, const char *text) {
  FMU *f = owner;
  if (f->callbacks.logger)
    f->callbacks.logger(f->callbacks.environment, f->name, status[level], category[level], "%s", text);
}

static int hex(char c) { return c <= '9' ? c - '0' : (c | 32) - 'a' + 10; }

/* The path of a file in the folder that a URI names: file:///a%20b */
static char *path_of(const char *uri, const char *file) {
  if (!uri) uri = "";
  if (!strncmp(uri, "file:", 5)) {
    uri += 5;
    if (!strncmp(uri, "///", 3)) uri += 2;
    else if (!strncmp(uri, "//localhost/", 12)) uri += 11;
#ifdef _WIN32
    if (uri[0] == '/' && uri[1] && uri[2] == ':') uri++;
#endif
  }
  char *path = malloc(strlen(uri) + strlen(file) + 2), *to = path;
  if (!path) return 0;
  while (*uri) {
    if (uri[0] == '%' && uri[1] && uri[2]) *to++ = (char)(16 * hex(uri[1]) + hex(uri[2])), uri += 3;
    else *to++ = *uri++;
  }
  if (to > path && to[-1] != '/' && to[-1] != '\\') *to++ = '/';
  strcpy(to, file);
  return path;
}

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }
API Status fmi2SetDebugLogging(void *c, int on, size_t n, const char *const categories[]) { return OK; }

API void fmi2FreeInstance(void *c) {
  FMU *f = c;
  if (!f) return;
  core_free(f->core);
  free(f->name);
  free(f);
}

API void *fmi2Instantiate(const char *name, Type type, const char *guid, const char *where, const Callbacks *callbacks,
                          int visible, int logging) {
  FMU *f = calloc(1, sizeof *f);
  char *path = path_of(where, "model.bin");
  if (!f || !path) return free(f), free(path), NULL;
  f->callbacks = *callbacks;
  f->name = malloc(strlen(name) + 1);
  if (f->name) {
    strcpy(f->name, name);
    f->core = core_new(path, guid, f, say);
  }
  free(path);
  if (f->core) return f->core->exchange = type == MODEL_EXCHANGE, f;
  fmi2FreeInstance(f);
  return NULL;
}

API Status fmi2SetupExperiment(void *c, int defined, double tolerance, double start, int stops, double stop) {
  if (defined) core_tolerance(CORE(c), tolerance);
  core_time(CORE(c), start);
  return OK;
}
API Status fmi2EnterInitializationMode(void *c) { return OK; }
API Status fmi2ExitInitializationMode(void *c) { RESULT(core_initialise(CORE(c))); }
API Status fmi2Terminate(void *c) { return OK; }
API Status fmi2Reset(void *c) {
  core_reset(CORE(c));
  return OK;
}

API Status fmi2GetReal(void *c, const unsigned r[], size_t n, double v[]) {
  for (size_t k = 0; k < n; k++)
    if (!core_get(CORE(c), r[k], v + k)) return ERROR;
  return OK;
}
API Status fmi2SetReal(void *c, const unsigned r[], size_t n, const double v[]) {
  for (size_t k = 0; k < n; k++)
    if (!core_set(CORE(c), r[k], v[k])) return ERROR;
  return OK;
}
#define NONE(type, name)                                                                                  \
  API Status fmi2Get##name(void *c, const unsigned r[], size_t n, type v[]) { return n ? ERROR : OK; }    \
  API Status fmi2Set##name(void *c, const unsigned r[], size_t n, type const v[]) { return n ? ERROR : OK; }
NONE(int, Integer)
NONE(int, Boolean)
NONE(const char *, String)

API Status fmi2GetFMUstate(void *c, void **state) {
  size_t size = core_saved_size(CORE(c));
  Saved *saved = *state ? *state : malloc(sizeof(Saved) + size);
  if (!saved) return ERROR;
  saved->size = size;
  core_save(CORE(c), saved->bytes);
  *state = saved;
  return OK;
}
API Status fmi2SetFMUstate(void *c, void *state) { RESULT(core_restore(CORE(c), ((Saved *)state)->bytes, ((Saved *)state)->size)); }
API Status fmi2FreeFMUstate(void *c, void **state) {
  if (state) free(*state), *state = NULL;
  return OK;
}
API Status fmi2SerializedFMUstateSize(void *c, void *state, size_t *size) {
  *size = ((Saved *)state)->size;
  return OK;
}
API Status fmi2SerializeFMUstate(void *c, void *state, char bytes[], size_t size) {
  if (size < ((Saved *)state)->size) return ERROR;
  memcpy(bytes, ((Saved *)state)->bytes, ((Saved *)state)->size);
  return OK;
}
API Status fmi2DeSerializeFMUstate(void *c, const char bytes[], size_t size, void **state) {
  Saved *saved = malloc(sizeof(Saved) + size);
  if (!saved) return ERROR;
  saved->size = size;
  memcpy(saved->bytes, bytes, size);
  *state = saved;
  return OK;
}
API Status fmi2GetDirectionalDerivative(void *c, const unsigned u[], size_t nu, const unsigned k[], size_t nk,
                                        const double dk[], double du[]) {
  RESULT(core_directional(CORE(c), u, nu, k, nk, dk, du));
}

/* model exchange */
API Status fmi2EnterEventMode(void *c) { return OK; }
API Status fmi2NewDiscreteStates(void *c, EventInfo *info) {
  core_next_stretch(CORE(c));
  memset(info, 0, sizeof *info);
  info->terminate = core_events(CORE(c));
  double next = core_next_break(CORE(c));
  info->defined = isfinite(next);
  info->next = info->defined ? next : 0;
  return OK;
}
API Status fmi2EnterContinuousTimeMode(void *c) { return OK; }
API Status fmi2CompletedIntegratorStep(void *c, int no_return, int *event, int *terminate) {
  *event = *terminate = 0;
  RESULT(core_completed(CORE(c)));
}
API Status fmi2SetTime(void *c, double t) {
  core_time(CORE(c), t);
  return OK;
}
API Status fmi2SetContinuousStates(void *c, const double x[], size_t n) {
  core_put_states(CORE(c), x);
  return OK;
}
API Status fmi2GetContinuousStates(void *c, double x[], size_t n) {
  core_get_states(CORE(c), x);
  return OK;
}
API Status fmi2GetDerivatives(void *c, double x[], size_t n) { RESULT(core_rates(CORE(c), x)); }
API Status fmi2GetEventIndicators(void *c, double z[], size_t n) { RESULT(core_indicators(CORE(c), z)); }
API Status fmi2GetNominalsOfContinuousStates(void *c, double x[], size_t n) {
  memcpy(x, CORE(c)->model.nominals, n * sizeof *x);
  return OK;
}

/* co-simulation */
API Status fmi2DoStep(void *c, double t, double h, int no_return) {
  if (!core_step(CORE(c), t + h)) return ERROR;
  return CORE(c)->ended ? DISCARD : OK; /* fmi2Terminated says that an event has ended the run */
}
API Status fmi2CancelStep(void *c) { return ERROR; }
API Status fmi2SetRealInputDerivatives(void *c, const unsigned r[], size_t n, const int order[], const double v[]) {
  for (size_t k = 0; k < n; k++)
    if (!core_set_derivative(CORE(c), r[k], order[k], v[k])) return ERROR;
  return OK;
}
API Status fmi2GetRealOutputDerivatives(void *c, const unsigned r[], size_t n, const int order[], double v[]) { return n ? ERROR : OK; }
API Status fmi2GetStatus(void *c, int kind, Status *v) { return DISCARD; }
API Status fmi2GetRealStatus(void *c, int kind, double *v) {
  if (kind != 2) return DISCARD; /* fmi2LastSuccessfulTime */
  *v = CORE(c)->t;
  return OK;
}
API Status fmi2GetIntegerStatus(void *c, int kind, int *v) { return DISCARD; }
API Status fmi2GetBooleanStatus(void *c, int kind, int *v) {
  if (kind != 3) return DISCARD; /* fmi2Terminated */
  *v = CORE(c)->ended;
  return OK;
}
API Status fmi2GetStringStatus(void *c, int kind, const char **v) { return DISCARD; }
