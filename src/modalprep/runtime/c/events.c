/* Events: expressions of channels and time whose signs change, and what ends a run. */
#include "core.h"
#include <math.h>
#include <stdio.h>

#define DEEPEST 64    /* runtime/indicators.py */
#define EXACT 1e-12   /* of the time of an event that ends a run */
enum { NUMBER, TIME_ITSELF, COORDINATE, COLUMN, ADD, MULTIPLY, POWER, FIRST_FUNCTION }; /* runtime/indicators.py */
typedef double (*Function)(double);
static const Function functions[] = { sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, log };

static double *numbers(Core *core, I place) { return (double *)(core->memory + place); }

static int says(Core *core, int failed, const Indicator *event, const char *what) {
  char text[200];
  snprintf(text, sizeof text, "event '%.64s' %s at t = %.9g s", event->name, what, core->t);
  core->say(core->owner, failed, text);
  return failed ? FAILED : DONE;
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
  return isnan(*value) ? says(core, 1, event, "is not a number") : DONE;
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
  if (last) core->ended = 1, says(core, 0, last, "ends the run");
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

int core_advance_to_event(Core *core, double end) {
  int going = UNDERWAY;
  while (going == UNDERWAY && !core->ended) {
    double before = core->t;
    core_save(core, core->back);
    going = core_advance(core, end, 1);
    if (!going) return FAILED;
    if (ends(core)) {
      if (!locate(core, before, core->t)) return FAILED;
      core->ended = 1;
      says(core, 0, ends(core), "ends the run");
    }
    keep_sides(core);
  }
  return DONE;
}
