/* Events: expressions of channels and time whose signs change, and what ends a run. */
#include "core.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEEPEST 64    /* runtime/indicators.py */
#define EXACT 1e-12   /* of the time of an event that ends a run */
#define PROBE 1e-4    /* of the time that is asked for: the step of rates */
enum { NUMBER, TIME_ITSELF, COORDINATE, COLUMN, ADD, MULTIPLY, POWER, FIRST_FUNCTION }; /* runtime/indicators.py */
typedef double (*Function)(double);
static const Function functions[] = { sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, log };

static double *numbers(Core *core, I place) { return (double *)(core->memory + place); }

static int says(Core *core, int level, const Indicator *event, const char *what) {
  char text[200];
  snprintf(text, sizeof text, "event '%.64s' %s at t = %.9g s", event->name, what, core->t);
  core->say(core->owner, level, text);
  return level == ERRORS ? FAILED : DONE;
}

static int needs_channels(Core *core, const Indicator *event) {
  for (I k = event->first; k < event->first + event->count; k++)
    if (core->model.codes[k].operation == COLUMN) return 1;
  return 0;
}

/* The value of an event's expression. */
int core_indicator(Core *core, I which, double *value) {
  const Indicator *event = core->model.indicators + which;
  double stack[DEEPEST], *top = stack - 1;
  if (needs_channels(core, event) && !core_observe(core)) return FAILED;
  for (I k = event->first; k < event->first + event->count; k++) {
    const Code *code = core->model.codes + k;
    switch (code->operation) {
      case NUMBER: *++top = code->number; break;
      case TIME_ITSELF: *++top = core->t; break;
      case COORDINATE: *++top = numbers(core, core->model.head->y)[(I)code->number]; break;
      case COLUMN: *++top = numbers(core, core->model.head->row)[(I)code->number]; break;
      case ADD: top--, top[0] += top[1]; break;
      case MULTIPLY: top--, top[0] *= top[1]; break;
      case POWER: top--, top[0] = pow(top[0], top[1]); break;
      default: *top = functions[code->operation - FIRST_FUNCTION](*top);
    }
  }
  *value = *top;
  return isnan(*value) ? says(core, ERRORS, event, "is not a number") : DONE;
}

int core_indicators(Core *core, double *values) {
  for (I k = 0; k < core->model.head->indicators; k++)
    if (!core_indicator(core, k, values + k)) return FAILED;
  return DONE;
}

/* Whether an expression has changed its sign since the last event; zero counts as crossed. */
static int crosses(Core *core, I k, double *side) {
  double z, before = core->side[k];
  const Indicator *event = core->model.indicators + k;
  *side = before;
  if (!core_indicator(core, k, &z)) return 0;
  *side = z > 0 ? 1 : z < 0 ? -1 : -before;
  return before != 0 && *side != before && (!event->direction || event->direction == *side);
}

static const Indicator *ends(Core *core) {
  double side;
  for (I k = 0; k < core->model.head->indicators; k++)
    if (core->model.indicators[k].terminal && crosses(core, k, &side)) return core->model.indicators + k;
  return 0;
}

static void keep_sides(Core *core) {
  for (I k = 0; k < core->model.head->indicators; k++) crosses(core, k, core->side + k);
}

void core_begin_events(Core *core) {
  for (I k = 0; k < core->model.head->indicators; k++) {
    double z = 0;
    core_indicator(core, k, &z);
    core->side[k] = z > 0 ? 1 : z < 0 ? -1 : 0;
  }
}

/* Look at the events of model exchange; returns whether one ends the run. */
int core_events(Core *core) {
  const Indicator *last = ends(core);
  keep_sides(core);
  if (last) core->ended = 1, says(core, NEWS, last, "ends the run");
  return core->ended;
}

/* Whether co-simulation looks for events. */
int core_watches(Core *core) {
  for (I k = 0; k < core->model.head->indicators; k++)
    if (core->model.indicators[k].terminal) return 1;
  return 0;
}

/* Halve the step in which an event ends the run, from the state before it, to the first time at which it has. */
static int locate(Core *core, double low, double high) {
  while (high - low > EXACT * fmax(fabs(low), fabs(high))) {
    double middle = low + (high - low) / 2;
    if (!core_restore(core, core->back, core_saved_size(core)) || !core_advance(core, middle, 0)) return FAILED;
    if (ends(core)) high = middle;
    else low = middle;
  }
  return core_restore(core, core->back, core_saved_size(core)) && core_advance(core, high, 0);
}

/* Values of the events that end a run, and their rates: by differences along those of the state. */
static int course(Core *core, double probe, double *value, double *rate, double *scratch) {
  I n = core->model.head->states;
  double t = core->t, *y = scratch, *moved = scratch + n, *ydot = scratch + 2 * n;
  core_get_states(core, y);
  if (!core_rates(core, ydot)) return FAILED;
  for (I k = 0; k < core->model.head->indicators; k++) {
    double later = 0, earlier = 0;
    if (!core->model.indicators[k].terminal) continue;
    int done = core_indicator(core, k, value + k);
    for (int side = 1; done && side >= -1; side -= 2) {
      for (I i = 0; i < n; i++) moved[i] = y[i] + side * probe * ydot[i];
      core_put_states(core, moved);
      core_time(core, t + side * probe);
      done = core_indicator(core, k, side > 0 ? &later : &earlier);
    }
    core_put_states(core, y);
    core_time(core, t);
    if (!done) return FAILED;
    rate[k] = (later - earlier) / (2 * probe);
  }
  return DONE;
}

/* Where in a step, from 0 to 1, the cubic of values and rates at both ends is farthest beyond zero; 1: nowhere. */
static double beyond_zero(double z0, double z1, double r0, double r1) {
  double a = 3 * (r0 + r1) - 6 * (z1 - z0), b = 6 * (z1 - z0) - 4 * r0 - 2 * r1; /* its rate: r0 + b s + a s^2 */
  if (z0 * z1 <= 0 || z0 * r0 >= 0 || z1 * r1 <= 0) return 1;
  double s = 2 * r0 / (-b + (r0 > 0 ? 1 : -1) * sqrt(fmax(b * b - 4 * a * r0, 0))); /* the only zero between */
  return s > 0 && s < 1 && z0 * (z0 + s * (r0 + s * (b / 2 + s * a / 3))) < 0 ? s : 1;
}

/* Take a step up to where an event that ends the run may have passed, and would have come back at the end. */
static int shorten(Core *core, double before, const double *z, double probe, double *scratch) {
  I m = core->model.head->indicators;
  const double *r = z + m;
  double h = core->t - before, first = 1, *z1 = scratch, *r1 = z1 + m;
  if (!course(core, probe, z1, r1, r1 + m)) return FAILED;
  for (I k = 0; k < m; k++)
    if (core->model.indicators[k].terminal) first = fmin(first, beyond_zero(z[k], z1[k], h * r[k], h * r1[k]));
  if (first == 1) return DONE;
  return core_restore(core, core->back, core_saved_size(core)) && core_advance(core, before + first * h, 0) ? UNDERWAY : FAILED;
}

static int advance_to_event(Core *core, double end, double *z, double *scratch) {
  double probe = PROBE * (end - core->t);
  size_t values = 16 * (size_t)core->model.head->indicators;
  int going = UNDERWAY, known = 0;
  while (going == UNDERWAY && !core->ended) {
    double before = core->t;
    if (!known && !course(core, probe, z, z + core->model.head->indicators, scratch)) return FAILED;
    core_save(core, core->back);
    going = core_advance(core, end, 1);
    if (!going) return FAILED;
    if (!ends(core)) {
      int shorter = shorten(core, before, z, probe, scratch);
      if (!shorter) return FAILED;
      known = shorter == DONE;
      if (known) memcpy(z, scratch, values);
      else going = UNDERWAY;
    }
    if (ends(core)) {
      if (!locate(core, before, core->t)) return FAILED;
      core->ended = 1;
      says(core, NEWS, ends(core), "ends the run");
    }
    keep_sides(core);
  }
  return DONE;
}

int core_advance_to_event(Core *core, double end) {
  size_t m = (size_t)core->model.head->indicators, n = (size_t)core->model.head->states;
  double *memory = malloc(8 * (4 * m + 3 * n)); /* values and rates at both ends of a step, and two states with a rate */
  int done = memory ? advance_to_event(core, end, memory, memory + 2 * m) : says(core, ERRORS, core->model.indicators, "has no memory");
  free(memory);
  return done;
}
