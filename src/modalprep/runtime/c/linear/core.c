/* Linear equations z' = A z + B i, o = C z + D i in the place of a multibody system. */
#include "../core.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TERMS 18        /* of the exponential of a matrix whose norm is at most one half: 1e-22 */
#define SAME_STEP 1e-12 /* of a step */

/* The file: the head, of which sizes alone are used, then start values of states and inputs, nominals, A, B, C, D. */
typedef struct {
  Core core;
  I n, ni, no;
  const double *start, *a, *b, *c, *d;
  double *z, *input, *next, *flow, *work; /* flow: exp([A B; 0 0] h), its first n rows */
  double step;
} Linear;

static Linear *linear(Core *core) { return (Linear *)core; }

static int fail(Core *core, const char *text) {
  core->say(core->owner, ERRORS, text);
  return FAILED;
}

static int read_file(Linear *own, const char *path) {
  FILE *file = fopen(path, "rb");
  if (!file) return FAILED;
  fseek(file, 0, SEEK_END);
  long length = ftell(file);
  rewind(file);
  char *bytes = own->core.model.file = length > (long)sizeof(Head) ? malloc((size_t)length) : 0;
  size_t size = bytes ? fread(bytes, 1, (size_t)length, file) : 0;
  fclose(file);
  if (!size || memcmp(bytes, "MPLINEAR", 8)) return FAILED;
  const Head *h = own->core.model.head = (const Head *)bytes;
  own->n = h->states, own->ni = h->inputs, own->no = h->width;
  own->start = (const double *)(bytes + sizeof(Head));
  own->core.model.nominals = own->start + own->n + own->ni;
  own->a = own->core.model.nominals + own->n;
  own->b = own->a + own->n * own->n;
  own->c = own->b + own->n * own->ni;
  own->d = own->c + own->no * own->n;
  return (const char *)(own->d + own->no * own->ni) == bytes + size;
}

Core *core_new(const char *path, const char *token, void *owner, Say say) {
  Linear *own = calloc(1, sizeof *own);
  if (!own) return 0;
  Core *core = &own->core;
  core->owner = owner;
  core->say = say;
  if (!read_file(own, path)) {
    fail(core, "resources/model.bin is missing, damaged or of another version");
  } else if (!token || strcmp(token, core->model.head->token)) {
    fail(core, "the modelDescription.xml is that of another FMU: the GUID or instantiation token differs");
  } else {
    size_t n = (size_t)own->n, m = n + (size_t)own->ni;
    own->z = calloc(n + m + n * m + 3 * m * m + 1, sizeof(double)); /* states, then inputs */
    if (own->z) {
      own->input = own->z + n;
      own->next = own->z + m;
      own->flow = own->next + n;
      own->work = own->flow + n * m;
      core_reset(core);
      return core;
    }
    fail(core, "there is not enough memory");
  }
  core_free(core);
  return 0;
}

void core_free(Core *core) {
  if (!core) return;
  free(core->model.file);
  free(linear(core)->z);
  free(core);
}

void core_reset(Core *core) {
  Linear *own = linear(core);
  memcpy(own->z, own->start, 8 * (size_t)(own->n + own->ni));
  core->t = 0;
  core->changeable = 1;
}

int core_initialise(Core *core) {
  core->changeable = 0;
  return DONE;
}

static double row(const double *m, I k, I columns, const double *x) {
  double sum = 0;
  for (I j = 0; j < columns; j++) sum += m[k * columns + j] * x[j];
  return sum;
}

/* The change of a rate or an output by changes of states and inputs; of the values themselves as well. */
static double rate(Linear *own, I k, const double *z, const double *input) {
  return row(own->a, k, own->n, z) + row(own->b, k, own->ni, input);
}
static double output(Linear *own, I k, const double *z, const double *input) {
  return row(own->c, k, own->n, z) + row(own->d, k, own->ni, input);
}

int core_get(Core *core, uint32_t reference, double *value) {
  Linear *own = linear(core);
  I k = reference & NUMBER_OF_VARIABLE;
  switch (reference & KIND_OF_VARIABLE) {
    case TIME: *value = core->t; return DONE;
    case STATE: if (k >= own->n) break; *value = own->z[k]; return DONE;
    case RATE: if (k >= own->n) break; *value = rate(own, k, own->z, own->input); return DONE;
    case CHANNEL: if (k >= own->no) break; *value = output(own, k, own->z, own->input); return DONE;
    case GIVEN: if (k >= own->ni) break; *value = own->input[k]; return DONE;
  }
  return fail(core, "there is no variable with this value reference");
}

int core_set(Core *core, uint32_t reference, double value) {
  Linear *own = linear(core);
  I k = reference & NUMBER_OF_VARIABLE;
  int kind = reference & KIND_OF_VARIABLE;
  if (!isfinite(value)) return fail(core, "a value that is to be set is not finite");
  if (kind == GIVEN && k < own->ni) own->input[k] = value;
  else if (kind == STATE && k < own->n && core->changeable) own->z[k] = value;
  else return fail(core, "a variable cannot be set now, or there is none with this value reference");
  return DONE;
}

/* Where the change of a known variable counts: among the states or the inputs. */
static double *seed_of(Linear *own, uint32_t reference) {
  I k = reference & NUMBER_OF_VARIABLE;
  int kind = reference & KIND_OF_VARIABLE;
  if (kind == STATE && k < own->n) return own->work + k;
  return kind == GIVEN && k < own->ni ? own->work + own->n + k : 0;
}

int core_directional(Core *core, const uint32_t unknown[], size_t nu, const uint32_t known[], size_t nk,
                     const double seed[], double found[]) {
  Linear *own = linear(core);
  memset(own->work, 0, 8 * (size_t)(own->n + own->ni));
  for (size_t k = 0; k < nk; k++) {
    double *at = seed_of(own, known[k]);
    if (!at) return fail(core, "there is no derivative by this variable");
    *at += seed[k];
  }
  for (size_t k = 0; k < nu; k++) {
    I i = unknown[k] & NUMBER_OF_VARIABLE;
    int kind = unknown[k] & KIND_OF_VARIABLE;
    if (kind == RATE && i < own->n) found[k] = rate(own, i, own->work, own->work + own->n);
    else if (kind == CHANNEL && i < own->no) found[k] = output(own, i, own->work, own->work + own->n);
    else if (kind == STATE && i < own->n) found[k] = own->work[i];
    else return fail(core, "there is no derivative of this variable");
  }
  return DONE;
}

void core_put_states(Core *core, const double *y) { memcpy(linear(core)->z, y, 8 * (size_t)linear(core)->n); }
void core_get_states(Core *core, double *y) { memcpy(y, linear(core)->z, 8 * (size_t)linear(core)->n); }
int core_rates(Core *core, double *ydot) {
  for (I k = 0; k < linear(core)->n; k++) ydot[k] = rate(linear(core), k, linear(core)->z, linear(core)->input);
  return DONE;
}

static void multiply(I m, const double *x, const double *y, double *product) {
  for (I i = 0; i < m; i++) {
    memset(product + i * m, 0, 8 * (size_t)m);
    for (I k = 0; k < m; k++)
      if (x[i * m + k] != 0)
        for (I j = 0; j < m; j++) product[i * m + j] += x[i * m + k] * y[k * m + j];
  }
}

/* exp([A B; 0 0] h) by scaling, Taylor's series and squaring: states and inputs held over a step. */
static void exponential(Linear *own, double h) {
  I m = own->n + own->ni;
  double *x = own->work, *sum = x + m * m, *term = sum + m * m, norm = 0;
  int halvings = 0;
  memset(x, 0, 8 * (size_t)(m * m));
  for (I i = 0; i < own->n; i++) {
    for (I j = 0; j < own->n; j++) x[i * m + j] = own->a[i * own->n + j] * h;
    for (I j = 0; j < own->ni; j++) x[i * m + own->n + j] = own->b[i * own->ni + j] * h;
    double size = 0;
    for (I j = 0; j < m; j++) size += fabs(x[i * m + j]);
    norm = fmax(norm, size);
  }
  for (; norm > 0.5 && halvings < 1000; norm /= 2) halvings++;
  for (I k = 0; k < m * m; k++) x[k] = ldexp(x[k], -halvings);
  memset(sum, 0, 8 * (size_t)(m * m));
  for (I i = 0; i < m; i++) sum[i * m + i] = 1;
  for (int order = TERMS; order > 0; order--) { /* Horner: I + x/1 (I + x/2 (I + ...)) */
    multiply(m, x, sum, term);
    for (I k = 0; k < m * m; k++) sum[k] = term[k] / order;
    for (I i = 0; i < m; i++) sum[i * m + i] += 1;
  }
  for (; halvings > 0; halvings--) {
    multiply(m, sum, sum, term);
    memcpy(sum, term, 8 * (size_t)(m * m));
  }
  memcpy(own->flow, sum, 8 * (size_t)(own->n * m));
  own->step = h;
}

int core_step(Core *core, double end) {
  Linear *own = linear(core);
  double h = end - core->t;
  if (!(h > 0)) return DONE;
  if (fabs(h - own->step) > SAME_STEP * h) exponential(own, h);
  for (I k = 0; k < own->n; k++) own->next[k] = row(own->flow, k, own->n + own->ni, own->z);
  memcpy(own->z, own->next, 8 * (size_t)own->n);
  core->t = end;
  return DONE;
}

size_t core_saved_size(Core *core) { return 8 * (size_t)(2 + linear(core)->n + linear(core)->ni); }
void core_save(Core *core, char *to) {
  double present[2] = { core->t, core->changeable };
  memcpy(to, present, sizeof present);
  memcpy(to + sizeof present, linear(core)->z, core_saved_size(core) - sizeof present);
}
int core_restore(Core *core, const char *from, size_t size) {
  double present[2];
  if (size != core_saved_size(core)) return fail(core, "the saved state is that of another FMU");
  memcpy(present, from, sizeof present);
  memcpy(linear(core)->z, from + sizeof present, size - sizeof present);
  core->t = present[0], core->changeable = (int)present[1];
  return DONE;
}

void core_tolerance(Core *core, double rtol) {}
void core_time(Core *core, double t) { core->t = t; }
int core_completed(Core *core) { return DONE; }
int core_next_stretch(Core *core) { return 0; }
double core_next_break(Core *core) { return INFINITY; }
int core_events(Core *core) { return 0; }
int core_indicators(Core *core, double *values) { return DONE; }
int core_set_derivative(Core *core, uint32_t reference, int order, double value) {
  return fail(core, "inputs of linear equations have no derivatives");
}
