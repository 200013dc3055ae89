/* Runs a flexible system from C: spin_up LIBRARY GUID RESOURCES OUTPUT STEP END. The library and the resources are those
   of an unpacked FMU 2.0 for co-simulation, GUID and the value reference of the output stand in its
   modelDescription.xml. Prints the output (one line for each second), the time that all steps took, and the longest. */
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* From fmi2FunctionTypes.h of the standard, which programs include in place of these lines. */
typedef void *Component;
typedef Component Instantiate(const char *, int, const char *, const char *, const void **, int, int);
typedef int SetupExperiment(Component, int, double, double, int, double), Initialise(Component);
typedef int DoStep(Component, double, double, int), GetReal(Component, const unsigned *, size_t, double *);
typedef void Free(Component);

static void say(void *e, const char *name, int status, const char *category, const char *form, ...) {
  fprintf(stderr, "%s: %s\n", name, form);
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int count, char **given) {
  void *library = count == 7 ? dlopen(given[1], RTLD_NOW) : NULL;
  if (!library) return fprintf(stderr, "%s\n", count == 7 ? dlerror() : "six arguments, see the first lines"), 2;
  Instantiate *instantiate = dlsym(library, "fmi2Instantiate");
  SetupExperiment *setup = dlsym(library, "fmi2SetupExperiment");
  Initialise *enter = dlsym(library, "fmi2EnterInitializationMode"), *leave = dlsym(library, "fmi2ExitInitializationMode");
  DoStep *step = dlsym(library, "fmi2DoStep");
  GetReal *get = dlsym(library, "fmi2GetReal");
  Free *release = dlsym(library, "fmi2FreeInstance");
  const void *callbacks[5] = { (void *)say, (void *)calloc, (void *)free, NULL, NULL };
  unsigned output = (unsigned)strtoul(given[4], NULL, 10);
  double h = atof(given[5]), end = atof(given[6]), value, all = 0, longest = 0;

  Component body = instantiate("body", 1, given[2], given[3], callbacks, 0, 0);
  if (!body || setup(body, 0, 0, 0, 1, end) || enter(body) || leave(body)) return 3;
  long steps = lround(end / h), second = lround(1 / h);
  for (long k = 0; k < steps; k++) {
    double before = now();
    if (step(body, k * h, h, 1)) return 4;
    double took = now() - before;
    all += took;
    longest = took > longest ? took : longest;
    if ((k + 1) % second == 0) {
      if (get(body, &output, 1, &value)) return 5;
      printf("%.17g %.17g\n", (k + 1) * h, value);
    }
  }
  fprintf(stderr, "%ld steps in %.3g s, the longest %.3g s\n", steps, all, longest);
  release(body);
  return 0;
}
