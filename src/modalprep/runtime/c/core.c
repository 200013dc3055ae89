/* What both versions of FMI share: load the image, evaluate, step, save. */
#include "core.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ALIGNMENT 64
#define GOOD -1
#define MOST_STEPS 1000
#define ROUND_OFF 1e-9
#define REGULAR 0.3 /* kernels/closed_loops/singularities.py */
enum { RUNNING, REACHED, FULL, STOPPED, DIVERGED, COLLAPSED, RAISED, WOUND, NEAR, CUT }; /* integration/driver.py */
enum { OPEN = -5 };                                                                   /* integration/stepping.py */
enum { EXPLICIT = 0 };

/* The kernels: compiled functions return a status of Python's, their value through the first argument. */
typedef struct {
  int (*derive)(I *, void **, void *, void *, double);
  int (*channels)(void **, void **, void *, void *, double);
  int (*enter)(I *, void **, void *, void *, void *, double);
  int (*complete)(I *, void **, void *, void *, void *, void *, double, double);
  int (*begin)(I *, void **, void *, void *, I, double, double);
  int (*advance)(I *, void **, void *, void *, void *, I, double, I);
#ifdef WITH_TANGENT /* trees */
  int (*differentiate)(I *, void **, void *, void *, void *, double);
  int (*follow)(void **, void **, void *, void *, void *);
#endif
} Kernels;
#ifdef WITH_TANGENT
#define DECLARE_TANGENT(p)                                                         \
  extern int p##differentiate(I *, void **, void *, void *, void *, double);       \
  extern int p##follow(void **, void **, void *, void *, void *);
#define TANGENT_OF(p) , p##differentiate, p##follow
#else
#define DECLARE_TANGENT(p)
#define TANGENT_OF(p)
#endif
#define DECLARE(p)                                                                 \
  extern int p##derive(I *, void **, void *, void *, double);                      \
  extern int p##channels(void **, void **, void *, void *, double);                \
  extern int p##enter(I *, void **, void *, void *, void *, double);               \
  extern int p##complete(I *, void **, void *, void *, void *, void *, double, double); \
  extern int p##begin(I *, void **, void *, void *, I, double, double);            \
  extern int p##advance(I *, void **, void *, void *, void *, I, double, I);         \
  DECLARE_TANGENT(p)
#define TABLE(p) { p##derive, p##channels, p##enter, p##complete, p##begin, p##advance TANGENT_OF(p) }
DECLARE(mp_)
static const Kernels baseline = TABLE(mp_);
#ifdef WITH_V3 /* the same for processors with AVX2 and FMA */
#include "../../compiler/c/processor.h"
DECLARE(mp3_)
static const Kernels v3 = TABLE(mp3_);
static const Kernels *kernels(void) { return is_v3() ? &v3 : &baseline; }
#else
static const Kernels *kernels(void) { return &baseline; }
#endif

static void *at(Core *core, I place) { return core->memory + place; }
static const Head *head(Core *core) { return core->model.head; }
static double *number(Core *core, I place) { return at(core, place); }

static int fail(Core *core, const char *text) {
  core->say(core->owner, ERRORS, text);
  return FAILED;
}

static int failed_at(Core *core, const char *what) {
  char text[200];
  snprintf(text, sizeof text, "%s at t = %.9g s", what, core->t);
  return fail(core, text);
}

static char *whole_file(const char *path, size_t *size) {
  FILE *file = fopen(path, "rb");
  if (!file) return 0;
  fseek(file, 0, SEEK_END);
  long length = ftell(file);
  rewind(file);
  char *bytes = length > 0 ? malloc((size_t)length) : 0;
  *size = bytes ? fread(bytes, 1, (size_t)length, file) : 0;
  fclose(file);
  return bytes;
}

static const void *next(const char **from, I bytes) {
  const char *found = *from;
  *from += bytes;
  return found;
}

static int read_model(Model *model, const char *path) {
  size_t size = 0;
  model->file = whole_file(path, &size);
  if (!model->file || size < sizeof(Head)) return FAILED;
  const Head *h = model->head = (const Head *)model->file;
  if (memcmp(h->magic, "MPMODEL4", 8)) return FAILED;
  const char *from = model->file + sizeof(Head);
  model->image = next(&from, h->image);
  model->relocations = next(&from, 8 * h->relocations);
  model->combined = next(&from, 8 * (h->combined + 1));
  model->terms = next(&from, (I)sizeof(Term) * h->terms);
  model->given = next(&from, (I)sizeof(Given) * h->given);
  model->places = next(&from, (I)sizeof(Place) * h->places);
  model->stretches = next(&from, (I)sizeof(Stretch) * h->stretches);
  model->middles = next(&from, 8 * h->middles);
  model->indicators = next(&from, (I)sizeof(Indicator) * h->indicators);
  model->codes = next(&from, (I)sizeof(Code) * h->codes);
  model->nominals = next(&from, 8 * h->states);
  model->slopes = next(&from, h->slopes);
  model->slope_relocations = next(&from, 8 * h->slope_relocations);
  return from == model->file + size;
}

/* Addresses are kept relative to the image; with a sign they are taken out of a copy again. */
static void relocate(const I *places, I count, char *memory, uint64_t by) {
  for (I k = 0; k < count; k++) {
    uint64_t word;
    memcpy(&word, memory + places[k], 8);
    word += by;
    memcpy(memory + places[k], &word, 8);
  }
}

static void relocate_image(Core *core, char *memory, uint64_t by) {
  relocate(core->model.relocations, head(core)->relocations, memory, by);
}

/* What was evaluated is no longer that of the state, the inputs and the time. */
static void changed(Core *core) { core->derived = core->observed = core->differentiated = 0; }

/* What is kept of an input: with its derivatives, the time at which they were given, and the motion at the last step. */
enum { VALUE, FIRST, SECOND, SINCE, PLACE, SPEED, BEND, OF_A_GIVEN };
static double *given(Core *core, I k, int what) { return core->given + k + what * head(core)->given; }

/* An input goes on from the time at which it was given, by its derivatives: value, rate, acceleration. */
static void input_at(Core *core, I k, double t, double found[3]) {
  double q = *given(core, k, VALUE), r = *given(core, k, FIRST), a = *given(core, k, SECOND);
  double s = r != 0 || a != 0 ? t - *given(core, k, SINCE) : 0;
  found[0] = q + s * (r + s * a / 2);
  found[1] = r + s * a;
  found[2] = a;
}

/* Write a knot of the function of an input. */
static void write_knot(Core *core, const Place *place, double t, const double input[3]) {
  double *knot = number(core, place->at) - 1; /* time, value, rate, acceleration */
  knot[0] = t;
  for (int c = 0; c < 3; c++) knot[1 + c] = place->factor * input[c];
}

static void put_knot(Core *core, I k, const Place *place) {
  double found[3], t = *given(core, k, SINCE) + place->later;
  input_at(core, k, t, found);
  write_knot(core, place, t, found);
}

/* A prescribed motion goes smoothly from where it is to where it was told to be at the end of a step. */
static void put_ramp(Core *core, I k, double end) {
  const Given *own = core->model.given + k;
  double found[3], now[3] = { *given(core, k, PLACE), *given(core, k, SPEED), *given(core, k, BEND) };
  double first = core->model.places[own->first + 1].later; /* of the knot at the end of the step */
  for (const Place *p = core->model.places + own->first; p < core->model.places + own->first + own->count; p++) {
    double t = p->later == 0 ? core->t : end + p->later - first;
    input_at(core, k, t, found);
    write_knot(core, p, t, p->later == 0 ? now : found);
  }
}

/* Take the motions at a time as those from which they go on; returns whether any moves. */
static int keep_motions(Core *core, double t) {
  int moves = 0;
  for (I k = 0; k < head(core)->inputs; k++) {
    double found[3];
    input_at(core, k, t, found);
    moves |= core->model.given[k].moves && (found[0] != *given(core, k, PLACE) || found[1] != 0 || found[2] != 0);
    for (int c = 0; c < 3; c++) *given(core, k, PLACE + c) = found[c];
  }
  return moves;
}

static void put_ramps(Core *core, double end) {
  for (I k = 0; k < head(core)->inputs; k++)
    if (core->model.given[k].moves) put_ramp(core, k, end);
  if (keep_motions(core, end)) core->restart = 1;
}

static void put_given(Core *core, I k) {
  const Given *own = core->model.given + k;
  for (const Place *p = core->model.places + own->first; p < core->model.places + own->first + own->count; p++) {
    if (p->later < 0) *number(core, p->at) = p->factor * *given(core, k, VALUE);
    else put_knot(core, k, p);
  }
}

static void enter_stretch(Core *core, I number_of) {
  const Stretch *s = core->model.stretches + number_of;
  core->stretch = number_of;
  for (I k = 0; k < head(core)->middles; k++) *number(core, core->model.middles[k]) = (s->begin + s->end) / 2;
  core->restart = 1;
  changed(core);
}

double *core_input(Core *core, I k) { return given(core, k, VALUE); }

/* Give an input another value for an evaluation. */
void core_put_input(Core *core, I k, double value) {
  *given(core, k, VALUE) = value;
  put_given(core, k);
  changed(core);
}

/* How many numbers are kept beside the image. */
static size_t kept(Core *core) { return (size_t)(OF_A_GIVEN * head(core)->given + head(core)->indicators); }

void core_reset(Core *core) {
  memcpy(core->memory, core->model.image, (size_t)head(core)->image);
  relocate_image(core, core->memory, (uint64_t)(uintptr_t)core->memory);
  memset(core->given, 0, 8 * kept(core));
  for (I k = 0; k < head(core)->given; k++) *given(core, k, VALUE) = core->model.given[k].start;
  core->method = head(core)->method;
  core->t = core->before = core->model.stretches[0].begin;
  core->changeable = 1;
  core->ended = 0;
  enter_stretch(core, 0);
}

static char *aligned(char *raw) {
  return (char *)(((uintptr_t)raw + ALIGNMENT - 1) & ~(uintptr_t)(ALIGNMENT - 1));
}

static int allocate(Core *core) {
  core->raw = malloc((size_t)head(core)->image + ALIGNMENT);
  core->raw_slopes = malloc((size_t)head(core)->slopes + ALIGNMENT);
  core->given = calloc(kept(core) + 1, sizeof(double));
  core->back = core_watches(core) ? malloc(core_saved_size(core)) : malloc(1);
  if (!core->raw || !core->raw_slopes || !core->given || !core->back) return FAILED;
  core->side = core->given + OF_A_GIVEN * head(core)->given;
  core->memory = aligned(core->raw);
  core->slopes = aligned(core->raw_slopes);
  memcpy(core->slopes, core->model.slopes, (size_t)head(core)->slopes);
  relocate(core->model.slope_relocations, head(core)->slope_relocations, core->slopes, (uint64_t)(uintptr_t)core->slopes);
  return DONE;
}

Core *core_new(const char *file, const char *token, void *owner, Say say) {
  Core *core = calloc(1, sizeof *core);
  if (!core) return 0;
  core->owner = owner;
  core->say = say;
  if (!read_model(&core->model, file)) {
    fail(core, "resources/model.bin is missing, damaged or of another version");
  } else if (!token || strcmp(token, head(core)->token)) {
    fail(core, "the modelDescription.xml is that of another FMU: the GUID or instantiation token differs");
  } else if (allocate(core)) {
    core_reset(core);
    return core;
  } else {
    fail(core, "there is not enough memory");
  }
  core_free(core);
  return 0;
}

void core_free(Core *core) {
  if (!core) return;
  free(core->model.file);
  free(core->raw);
  free(core->raw_slopes);
  free(core->given);
  free(core->back);
  free(core);
}

void core_tolerance(Core *core, double rtol) { *number(core, head(core)->rtol) = rtol; }

static int derive(Core *core) {
  I status = 0;
  void *raised = 0;
  if (core->derived) return DONE;
  kernels()->derive(&status, &raised, at(core, head(core)->equations), at(core, head(core)->outside), core->t);
  core->derived = status == GOOD;
  core->observed = 0;
  if (status == OPEN) return failed_at(core, "the closed loops cannot be closed");
  return core->derived ? DONE : failed_at(core, "the accelerations cannot be computed");
}

int core_observe(Core *core) {
  void *nothing = 0, *raised = 0;
  if (core->observed) return DONE;
  if (!derive(core)) return FAILED;
  kernels()->channels(&nothing, &raised, at(core, head(core)->equations), at(core, head(core)->outside), core->t);
  core->observed = 1;
  return DONE;
}

/* Choose the stretch of the time, and bring the start values onto closed loops. */
int core_initialise(Core *core) {
  I status = 0;
  void *raised = 0;
  I k = 0;
  while (k + 1 < head(core)->stretches && core->t >= core->model.stretches[k].end) k++;
  enter_stretch(core, k);
  kernels()->enter(&status, &raised, at(core, head(core)->equations), at(core, head(core)->outside),
                   at(core, head(core)->run), core->t);
  if (status != GOOD) return failed_at(core, status == OPEN ? "the closed loops cannot be closed at the start values"
                                                            : "the accelerations cannot be computed");
  memcpy(at(core, head(core)->y), at(core, head(core)->state), 8 * (size_t)head(core)->states);
  core->before = core->t;
  core->changeable = 0;
  keep_motions(core, core->t);
  core_begin_events(core);
  return DONE;
}

static int combine(Core *core, I k, double *value) {
  const double *row = at(core, head(core)->row);
  *value = 0;
  for (I j = core->model.combined[k]; j < core->model.combined[k + 1]; j++)
    *value += core->model.terms[j].factor * row[core->model.terms[j].column];
  return DONE;
}

int core_get(Core *core, uint32_t reference, double *value) {
  const Head *h = head(core);
  I k = reference & NUMBER_OF_VARIABLE;
  switch (reference & KIND_OF_VARIABLE) {
    case TIME:
      if (k) break;
      *value = core->t;
      return DONE;
    case STATE:
      if (k >= h->states) break;
      *value = number(core, h->y)[k];
      return DONE;
    case RATE:
      if (k >= h->states) break;
      if (!derive(core)) return FAILED;
      *value = number(core, h->ydot)[k];
      return DONE;
    case CHANNEL:
      if (k >= h->width) break;
      if (!core_observe(core)) return FAILED;
      *value = number(core, h->row)[k];
      return DONE;
    case COMBINED:
      if (k >= h->combined) break;
      return core_observe(core) && combine(core, k, value);
    case GIVEN:
      if (k >= h->given) break;
      *value = *given(core, k, VALUE);
      return DONE;
    case GIVEN_RATE:
    case GIVEN_ACCELERATION:
      if (k >= h->inputs) break;
      *value = *given(core, k, (reference & KIND_OF_VARIABLE) == GIVEN_RATE ? FIRST : SECOND);
      return DONE;
    case INDICATOR:
      if (k >= h->indicators) break;
      return core_indicator(core, k, value);
  }
  return fail(core, "there is no variable with this value reference");
}

/* Whether an input takes effect in the next step only. */
static int ramps(Core *core, I k) { return core->model.given[k].moves && !core->exchange && !core->changeable; }

static int put_derivative(Core *core, I k, int what, double value) {
  if (!isfinite(value)) return fail(core, "a derivative that is to be set is not finite");
  if (*given(core, k, what) == 0 && value == 0) return DONE;
  *given(core, k, what) = value;
  *given(core, k, SINCE) = core->t;
  if (!ramps(core, k)) put_given(core, k);
  changed(core);
  core->restart = 1;
  return DONE;
}

int core_set(Core *core, uint32_t reference, double value) {
  I k = reference & NUMBER_OF_VARIABLE;
  int kind = reference & KIND_OF_VARIABLE;
  if (!isfinite(value)) return fail(core, "a value that is to be set is not finite");
  if (kind == GIVEN && k < head(core)->given && (k < head(core)->inputs || core->changeable)) {
    int moves = core->model.given[k].moves;
    if (*given(core, k, VALUE) == value && !moves && *given(core, k, FIRST) == 0) return DONE;
    *given(core, k, VALUE) = value;
    if (!moves) *given(core, k, FIRST) = *given(core, k, SECOND) = 0;
    *given(core, k, SINCE) = core->t;
    if (!ramps(core, k)) put_given(core, k);
  } else if ((kind == GIVEN_RATE || kind == GIVEN_ACCELERATION) && k < head(core)->inputs && core->model.given[k].moves) {
    return put_derivative(core, k, kind == GIVEN_RATE ? FIRST : SECOND, value);
  } else if (kind == STATE && k < head(core)->states && core->changeable) {
    number(core, head(core)->y)[k] = value;
  } else {
    return fail(core, "a variable cannot be set now, or there is none with this value reference");
  }
  changed(core);
  core->restart = 1;
  return DONE;
}

/* Set a derivative of an input, after its value; those of a prescribed motion are inputs themselves. */
int core_set_derivative(Core *core, uint32_t reference, int order, double value) {
  I k = reference & NUMBER_OF_VARIABLE;
  int kind = reference & KIND_OF_VARIABLE;
  if (kind < GIVEN || kind > GIVEN_ACCELERATION || k >= head(core)->inputs || order < 1 || order > 2)
    return fail(core, "a derivative is of an order above 2, or not that of an input");
  return core->model.given[k].moves ? DONE : put_derivative(core, k, order == 1 ? FIRST : SECOND, value);
}

/* Write how the accelerations change with the state. */
int core_differentiate(Core *core) {
#ifdef WITH_TANGENT
  I status = 0;
  void *raised = 0;
  if (core->differentiated) return derive(core); /* the state, which other evaluations have overwritten */
  kernels()->differentiate(&status, &raised, at(core, head(core)->equations), at(core, head(core)->outside),
                           core->slopes + head(core)->tangent, core->t);
  core->derived = core->differentiated = status == GOOD;
  core->observed = 0;
  if (status == GOOD) return DONE;
#endif
  return failed_at(core, "the derivatives of the accelerations cannot be computed");
}

/* Write what the rates change by along the seed. */
void core_follow(Core *core) {
#ifdef WITH_TANGENT
  void *nothing = 0, *raised = 0;
  kernels()->follow(&nothing, &raised, at(core, head(core)->equations), at(core, head(core)->outside),
                    core->slopes + head(core)->tangent);
#endif
}

void core_time(Core *core, double t) {
  if (t != core->t) changed(core);
  core->t = t;
}

void core_put_states(Core *core, const double *y) {
  memcpy(at(core, head(core)->y), y, 8 * (size_t)head(core)->states);
  changed(core);
}

void core_get_states(Core *core, double *y) { memcpy(y, at(core, head(core)->y), 8 * (size_t)head(core)->states); }

static int within(Core *core, double t) {
  double end = core->model.stretches[head(core)->stretches - 1].end;
  if (!head(core)->bounded || t <= end + ROUND_OFF * fabs(end)) return DONE;
  char text[200];
  snprintf(text, sizeof text, "functions of time were written up to t = %.9g s, and %.9g s is asked for", end, t);
  return fail(core, text);
}

int core_rates(Core *core, double *ydot) {
  if (!derive(core)) return FAILED; /* also beyond the end, where steps of others may try */
  memcpy(ydot, at(core, head(core)->ydot), 8 * (size_t)head(core)->states);
  return DONE;
}

static int stopped(Core *core, I code) {
  switch (code) {
    case DIVERGED: return failed_at(core, "the run has diverged: a body deflects by more than 100 times its size");
    case WOUND: return failed_at(core, "a bushing or rotational spring passes half a turn, where its torque would jump");
    case COLLAPSED: return failed_at(core, "the integration cannot go on with shorter and shorter steps");
  }
  return failed_at(core, "the accelerations cannot be computed");
}

/* Say once that closed loops come near a position in which a condition loses its direction. */
static void tell_near(Core *core) {
  char text[300];
  snprintf(text, sizeof text, "near t = %.9g s the closed loops come close to a position in which a closure loses a condition: "
           "if it is a change point, where branches of the motion cross, the FMU does not tell along which the motion goes on; "
           "simulate does", core->t);
  core->say(core->owner, WARNINGS, text);
  *(I *)at(core, head(core)->looks) = 0;
}

/* Look at how near the evaluations since the last step came to such a position. */
static void look(Core *core) {
  if (!*(I *)at(core, head(core)->looks)) return;
  double *sine = number(core, head(core)->sine);
  if (*sine < REGULAR) tell_near(core);
  *sine = 1;
}

/* A step of another integrator is complete. */
int core_completed(Core *core) {
  I status = 0;
  void *raised = 0;
  double h = core->t - core->before;
  if (!within(core, core->t)) return FAILED;
  kernels()->complete(&status, &raised, at(core, head(core)->equations), at(core, head(core)->outside),
                      at(core, head(core)->run), at(core, head(core)->watch), core->t, h);
  core->before = core->t;
  look(core);
  core->derived = status == GOOD;
  core->observed = 0;
  return status == GOOD ? DONE : stopped(core, status);
}

double core_next_break(Core *core) {
  return core->stretch + 1 < head(core)->stretches ? core->model.stretches[core->stretch].end : INFINITY;
}

/* Go on to the stretch that begins now, if one does. */
int core_next_stretch(Core *core) {
  double end = core_next_break(core);
  int begins = core->t >= end - ROUND_OFF * fabs(end);
  if (begins) enter_stretch(core, core->stretch + 1);
  return begins;
}

static int begin(Core *core, double end) {
  I status = 0;
  void *raised = 0;
  kernels()->begin(&status, &raised, at(core, head(core)->equations), at(core, head(core)->run), core->method, core->t, end);
  core->restart = 0;
  return status == GOOD ? DONE : failed_at(core, "the accelerations cannot be computed");
}

/* Take steps up to a time, or one step; UNDERWAY before the end. */
int core_advance(Core *core, double end, int once) {
  I code = RUNNING;
  void *raised = 0;
  if (core->restart && !begin(core, end)) return FAILED;
  do {
    kernels()->advance(&code, &raised, at(core, head(core)->equations), at(core, head(core)->run),
                       at(core, head(core)->watch), core->method, end, once ? 1 : MOST_STEPS);
    core->t = *number(core, head(core)->time);
    if (code == COLLAPSED && head(core)->may_change && core->method != EXPLICIT) {
      core->method = EXPLICIT; /* as the native run goes on without an implicit method that does not converge */
      if (!begin(core, end)) return FAILED;
      code = RUNNING;
    }
    if (code == NEAR) tell_near(core), code = RUNNING;
  } while (code == RUNNING && !once);
  changed(core);
  if (code == RUNNING) return UNDERWAY;
  return code == REACHED ? DONE : stopped(core, code);
}

int core_step(Core *core, double end) {
  if (!within(core, end)) return FAILED;
  if (core->t < end) put_ramps(core, end);
  while (core->t < end && !core->ended) {
    core_next_stretch(core);
    double stop = fmin(end, core_next_break(core));
    if (!(core_watches(core) ? core_advance_to_event(core, stop) : core_advance(core, stop, 0))) return FAILED;
  }
  return DONE;
}

/* A saved state: the present of the instance, the values given, the image with relative addresses. */
typedef struct { double t, before; I stretch, method, restart, changeable, ended; } Present;

size_t core_saved_size(Core *core) {
  return sizeof(Present) + 8 * kept(core) + (size_t)head(core)->image;
}

void core_save(Core *core, char *to) {
  Present p = { core->t, core->before, core->stretch, core->method, core->restart, core->changeable, core->ended };
  size_t given = 8 * kept(core);
  memcpy(to, &p, sizeof p);
  memcpy(to + sizeof p, core->given, given);
  memcpy(to + sizeof p + given, core->memory, (size_t)head(core)->image);
  relocate_image(core, to + sizeof p + given, -(uint64_t)(uintptr_t)core->memory);
}

int core_restore(Core *core, const char *from, size_t size) {
  Present p;
  size_t given = 8 * kept(core);
  if (size != core_saved_size(core)) return fail(core, "the saved state is that of another FMU");
  memcpy(&p, from, sizeof p);
  memcpy(core->given, from + sizeof p, given);
  memcpy(core->memory, from + sizeof p + given, (size_t)head(core)->image);
  relocate_image(core, core->memory, (uint64_t)(uintptr_t)core->memory);
  core->t = p.t, core->before = p.before, core->stretch = p.stretch, core->method = p.method;
  core->restart = (int)p.restart, core->changeable = (int)p.changeable, core->ended = (int)p.ended;
  changed(core);
  return DONE;
}
