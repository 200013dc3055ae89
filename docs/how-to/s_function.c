/* A C MEX S-function of Simulink around an FMU 2.0 for co-simulation: one input, one output, a fixed step.
   Parameters of the block: library, GUID, resources (URI), value references of input and output, step (s).
   mex s_function.c (on Windows as it is, elsewhere with -ldl). */
#define S_FUNCTION_NAME s_function
#define S_FUNCTION_LEVEL 2
#include "simstruc.h"
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
#define LOAD(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)library, name))
#else
#include <dlfcn.h>
#define LOAD(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

/* From fmi2FunctionTypes.h of the standard, which programs include in place of these lines. */
typedef void *Component;
typedef Component Instantiate(const char *, int, const char *, const char *, const void **, int, int);
typedef int SetupExperiment(Component, int, double, double, int, double), Initialise(Component);
typedef int DoStep(Component, double, double, int), GetReal(Component, const unsigned *, size_t, double *);
typedef int SetReal(Component, const unsigned *, size_t, const double *);
typedef void Free(Component);
enum { LIBRARY, GUID, RESOURCES, INPUT, OUTPUT, STEP, PARAMETERS };
typedef struct {
  Component body;
  SetReal *set;
  GetReal *get;
  DoStep *step;
  Free *release;
  unsigned input, output;
} Unit;

static double number(SimStruct *S, int k) { return mxGetScalar(ssGetSFcnParam(S, k)); }

static void say(void *e, const char *name, int status, const char *category, const char *form, ...) {}

static void mdlInitializeSizes(SimStruct *S) {
  ssSetNumSFcnParams(S, PARAMETERS);
  if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) return;
  if (!ssSetNumInputPorts(S, 1) || !ssSetNumOutputPorts(S, 1)) return;
  ssSetInputPortWidth(S, 0, 1);
  ssSetInputPortDirectFeedThrough(S, 0, 0); /* the input of a step counts from its begin */
  ssSetOutputPortWidth(S, 0, 1);
  ssSetNumSampleTimes(S, 1);
  ssSetNumPWork(S, 1);
}

static void mdlInitializeSampleTimes(SimStruct *S) {
  ssSetSampleTime(S, 0, number(S, STEP));
  ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_START
static void mdlStart(SimStruct *S) {
  char text[3][1024];
  static const void *callbacks[5] = { (void *)say, (void *)calloc, (void *)free, NULL, NULL };
  Unit *unit = calloc(1, sizeof *unit);
  for (int k = LIBRARY; k <= RESOURCES; k++) mxGetString(ssGetSFcnParam(S, k), text[k], sizeof text[k]);
  ssSetPWorkValue(S, 0, unit);
  void *library = LOAD(text[LIBRARY]);
  if (!library || !unit) {
    ssSetErrorStatus(S, "the library cannot be loaded");
    return;
  }
  Instantiate *instantiate = FIND(library, "fmi2Instantiate");
  SetupExperiment *setup = FIND(library, "fmi2SetupExperiment");
  Initialise *enter = FIND(library, "fmi2EnterInitializationMode"), *leave = FIND(library, "fmi2ExitInitializationMode");
  unit->set = FIND(library, "fmi2SetReal");
  unit->get = FIND(library, "fmi2GetReal");
  unit->step = FIND(library, "fmi2DoStep");
  unit->release = FIND(library, "fmi2FreeInstance");
  unit->input = (unsigned)number(S, INPUT);
  unit->output = (unsigned)number(S, OUTPUT);
  unit->body = instantiate("body", 1, text[GUID], text[RESOURCES], callbacks, 0, 0);
  if (!unit->body || setup(unit->body, 0, 0, ssGetT(S), 0, 0) || enter(unit->body) || leave(unit->body))
    ssSetErrorStatus(S, "the FMU cannot be initialised: its GUID, its resources or its closed loops");
}

static void mdlOutputs(SimStruct *S, int_T tid) {
  Unit *unit = ssGetPWorkValue(S, 0);
  if (unit->get(unit->body, &unit->output, 1, ssGetOutputPortRealSignal(S, 0))) ssSetErrorStatus(S, "there is no output");
}

#define MDL_UPDATE
static void mdlUpdate(SimStruct *S, int_T tid) {
  Unit *unit = ssGetPWorkValue(S, 0);
  if (unit->set(unit->body, &unit->input, 1, *ssGetInputPortRealSignalPtrs(S, 0)) ||
      unit->step(unit->body, ssGetT(S), number(S, STEP), 1))
    ssSetErrorStatus(S, "the step failed");
}

static void mdlTerminate(SimStruct *S) {
  Unit *unit = ssGetPWorkValue(S, 0);
  if (unit && unit->body) unit->release(unit->body);
  free(unit);
}

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
