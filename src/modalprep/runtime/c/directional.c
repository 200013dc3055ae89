/* Directional derivatives: of rates exactly, of other variables by differences along the direction. */
#include "core.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STEP 0.02 /* of the nominal sizes; three levels of Richardson: errors of STEP^6 and of round-off over STEP */
enum { LEVELS = 3 };

static const Head *head(Core *core) { return core->model.head; }
static double *seed_of_states(Core *core) { return (double *)(core->slopes + head(core)->seed); }

static int fail(Core *core, const char *text) {
  core->say(core->owner, ERRORS, text);
  return FAILED;
}

/* A direction: of the states, which the kernels read, and of the inputs; the state and the inputs from which it goes. */
typedef struct {
  double *inputs, *state, *from, *moved;
} Direction;

static int read_direction(Core *core, Direction *d, const uint32_t known[], size_t nk, const double seed[]) {
  I n = head(core)->states, inputs = head(core)->inputs;
  memset(seed_of_states(core), 0, 8 * (size_t)n);
  for (size_t k = 0; k < nk; k++) {
    I i = known[k] & NUMBER_OF_VARIABLE;
    int kind = known[k] & KIND_OF_VARIABLE;
    if (kind == STATE && i < n) seed_of_states(core)[i] += seed[k];
    else if (kind == GIVEN && i < inputs) d->inputs[i] += seed[k];
    else return fail(core, "there is no derivative by this variable: it is neither a state nor an input");
  }
  return DONE;
}

static void put(Core *core, Direction *d, double step, int states) {
  I n = head(core)->states;
  for (I k = 0; k < n; k++) d->moved[k] = d->state[k] + (states ? step * seed_of_states(core)[k] : 0);
  core_put_states(core, d->moved);
  for (I k = 0; k < head(core)->inputs; k++)
    if (d->inputs[k] != 0) core_put_input(core, k, d->from[k] + step * d->inputs[k]);
}

static double largest(const double *x, I n) {
  double most = 0;
  for (I k = 0; k < n; k++) most = fmax(most, fabs(x[k]));
  return most;
}

/* Half the change of the rates between two steps along the inputs, in which they are affine. */
static int change(Core *core, Direction *d, double step, double *found, double *other) {
  I n = head(core)->states;
  put(core, d, step, 0);
  if (!core_rates(core, found)) return FAILED;
  put(core, d, -step, 0);
  if (!core_rates(core, other)) return FAILED;
  for (I k = 0; k < n; k++) found[k] = (found[k] - other[k]) / 2;
  return DONE;
}

/* Add what the rates change by with the inputs, by a step that changes them by as much as they are. */
static int add_inputs(Core *core, Direction *d, double *sum) {
  I n = head(core)->states;
  double step = largest(d->inputs, head(core)->inputs);
  if (step == 0) return DONE;
  double *found = malloc(16 * (size_t)n);
  int done = found != 0;
  step = 1 / step;
  if (done) done = change(core, d, step, found, found + n);
  if (done) {
    double made = largest(found, n), there = largest(found + n, n);
    if (made > 0 && made < there) step *= there / made, done = change(core, d, step, found, found + n);
  }
  for (I k = 0; done && k < n; k++) sum[k] += found[k] / step;
  free(found);
  put(core, d, 0, 0);
  return done;
}

/* The step of the differences, in the sizes of states and inputs. */
static double step_of(Core *core, Direction *d) {
  double most = 0;
  for (I k = 0; k < head(core)->states; k++) most = fmax(most, fabs(seed_of_states(core)[k]) / core->model.nominals[k]);
  for (I k = 0; k < head(core)->inputs; k++) most = fmax(most, fabs(d->inputs[k]) / fmax(1, fabs(d->from[k])));
  return most > 0 ? STEP / most : 0;
}

static int values(Core *core, const uint32_t reference[], size_t n, double value[]) {
  for (size_t k = 0; k < n; k++)
    if (!core_get(core, reference[k], value + k)) return FAILED;
  return DONE;
}

/* Differences of all unknowns: for each level n of them; the last is the best. */
static int differences(Core *core, Direction *d, const uint32_t unknown[], size_t n, double *table) {
  double step = step_of(core, d), *back = table + LEVELS * n;
  memset(table, 0, 8 * (LEVELS + 1) * n);
  for (int level = 0; step > 0 && level < LEVELS; level++, step /= 2) {
    double *own = table + (size_t)level * n;
    put(core, d, step, 1);
    if (!values(core, unknown, n, own)) return FAILED;
    put(core, d, -step, 1);
    if (!values(core, unknown, n, back)) return FAILED;
    for (size_t k = 0; k < n; k++) own[k] = (own[k] - back[k]) / (2 * step);
  }
  for (int order = 1, factor = 4; order < LEVELS; order++, factor *= 4)
    for (int level = LEVELS - 1; level >= order; level--)
      for (size_t k = 0; k < n; k++)
        table[(size_t)level * n + k] += (table[(size_t)level * n + k] - table[(size_t)(level - 1) * n + k]) / (factor - 1);
  return DONE;
}

/* Whether the derivative of a variable is exact: of states and their rates but that of the work, which is the last. */
static int is_exact(Core *core, uint32_t reference) {
  int kind = reference & KIND_OF_VARIABLE;
  return kind == STATE || (kind == RATE && (reference & NUMBER_OF_VARIABLE) < head(core)->states - 1);
}

static int rates(Core *core, Direction *d, double *found) {
  I n = head(core)->states;
  if (!core_differentiate(core)) return FAILED;
  core_follow(core);
  memcpy(found, core->slopes + head(core)->found, 8 * (size_t)n);
  return add_inputs(core, d, found);
}

static int derivatives(Core *core, Direction *d, const uint32_t unknown[], size_t nu, double found[], double *table) {
  int by_rates = 0, by_differences = 0;
  double *rate = table + (LEVELS + 1) * nu;
  for (size_t k = 0; k < nu; k++) {
    int exact = is_exact(core, unknown[k]);
    by_rates |= exact && (unknown[k] & KIND_OF_VARIABLE) == RATE;
    by_differences |= !exact;
  }
  if (by_rates && !rates(core, d, rate)) return FAILED;
  if (by_differences && !differences(core, d, unknown, nu, table)) return FAILED;
  for (size_t k = 0; k < nu; k++) {
    I i = unknown[k] & NUMBER_OF_VARIABLE;
    if (!is_exact(core, unknown[k])) found[k] = table[(LEVELS - 1) * nu + k];
    else if ((unknown[k] & KIND_OF_VARIABLE) == RATE) found[k] = rate[i];
    else if (i < head(core)->states) found[k] = seed_of_states(core)[i];
    else return fail(core, "there is no derivative of this variable");
  }
  return DONE;
}

int core_directional(Core *core, const uint32_t unknown[], size_t nu, const uint32_t known[], size_t nk,
                     const double seed[], double found[]) {
  if (!head(core)->slopes) return fail(core, "this FMU has no directional derivatives");
  size_t n = (size_t)head(core)->states, inputs = (size_t)head(core)->inputs;
  double *memory = calloc(2 * inputs + 3 * n + (LEVELS + 1) * nu + 1, sizeof(double));
  if (!memory) return fail(core, "there is not enough memory");
  Direction d = { memory, memory + 2 * inputs, memory + inputs, memory + 2 * inputs + n };
  core_get_states(core, d.state);
  for (size_t k = 0; k < inputs; k++) d.from[k] = *core_input(core, (I)k);
  int done = read_direction(core, &d, known, nk, seed) &&
             derivatives(core, &d, unknown, nu, found, memory + 2 * inputs + 2 * n);
  int as_it_was = core->differentiated;
  put(core, &d, 0, 0);
  core->differentiated = as_it_was;
  free(memory);
  return done;
}
