/* Run the co-simulation of an FMU 2.0 as a program would: load.c LIBRARY TOKEN RESOURCES STEPS STEP INPUT VALUE OUTPUT...
   prints the outputs, given by their value references, of two instances, of which the second has the input doubled. */
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(path) LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress(library, name)
#elif defined(LINKED)
#define OPEN(path) (void *)1
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif
typedef void *C;
typedef C New(const char *, int, const char *, const char *, const void **, int, int);
typedef int Setup(C, int, double, double, int, double), Do(C), Step(C, double, double, int);
typedef int Get(C, const unsigned *, size_t, double *), Set(C, const unsigned *, size_t, const double *);
#ifdef LINKED
New fmi2Instantiate;
Setup fmi2SetupExperiment;
Do fmi2EnterInitializationMode, fmi2ExitInitializationMode;
Step fmi2DoStep;
Get fmi2GetReal;
Set fmi2SetReal;
#define FIND(library, name) name
#define NAME(x) x
#else
#define NAME(x) #x
#endif

static void log_text(void *e, const char *name, int status, const char *category, const char *form, const char *text) {
  fprintf(stderr, "%s\n", text);
}

int main(int count, char **given) {
  void *library = (void *)OPEN(given[1]);
  if (count < 9 || !library) return 2;
  New *make = FIND(library, NAME(fmi2Instantiate));
  Setup *setup = FIND(library, NAME(fmi2SetupExperiment));
  Do *enter = FIND(library, NAME(fmi2EnterInitializationMode)), *leave = FIND(library, NAME(fmi2ExitInitializationMode));
  Step *step = FIND(library, NAME(fmi2DoStep));
  Get *get = FIND(library, NAME(fmi2GetReal));
  Set *set = FIND(library, NAME(fmi2SetReal));
  const void *callbacks[5] = { (void *)log_text, 0, 0, 0, 0 };
  int steps = atoi(given[4]);
  double h = atof(given[5]);
  unsigned input = (unsigned)atol(given[6]);
  for (int which = 1; which <= 2; which++) {
    double value = which * atof(given[7]);
    C one = make("one", 1, given[2], given[3], callbacks, 0, 0);
    if (!one || setup(one, 1, 1e-8, 0, 0, 0) || enter(one) || leave(one) || set(one, &input, 1, &value)) return 3;
    for (int k = 0; k < steps; k++)
      if (step(one, k * h, h, 1)) return 4;
    for (int k = 8; k < count; k++) {
      unsigned reference = (unsigned)atol(given[k]);
      if (get(one, &reference, 1, &value)) return 5;
      printf("%.17g ", value);
    }
  }
  return 0;
}
