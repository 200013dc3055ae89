/* What s_function.c needs of Simulink's header, with the types that MathWorks documents: a stand-in of our own. */
#include <stddef.h>
#include <string.h>

typedef int int_T;
typedef double real_T;
typedef const real_T *const *InputRealPtrsType;
typedef struct {
  const char *text;
  double number;
} mxArray;
typedef struct {
  int_T parameters, given, ports, width[2], feeds, times, pointers;
  real_T sample, offset, time, output;
  const real_T *input;
  const mxArray *parameter;
  const char *error;
  void *work;
} SimStruct;

static void ssSetNumSFcnParams(SimStruct *S, int_T n) { S->parameters = n; }
static int_T ssGetNumSFcnParams(SimStruct *S) { return S->parameters; }
static int_T ssGetSFcnParamsCount(SimStruct *S) { return S->given; }
static const mxArray *ssGetSFcnParam(SimStruct *S, int_T k) { return S->parameter + k; }
static int_T ssSetNumInputPorts(SimStruct *S, int_T n) { return S->ports += n; }
static int_T ssSetNumOutputPorts(SimStruct *S, int_T n) { return S->ports += n; }
static void ssSetInputPortWidth(SimStruct *S, int_T k, int_T n) { S->width[0] = n; }
static void ssSetOutputPortWidth(SimStruct *S, int_T k, int_T n) { S->width[1] = n; }
static void ssSetInputPortDirectFeedThrough(SimStruct *S, int_T k, int_T feeds) { S->feeds = feeds; }
static void ssSetNumSampleTimes(SimStruct *S, int_T n) { S->times = n; }
static void ssSetNumPWork(SimStruct *S, int_T n) { S->pointers = n; }
static void ssSetSampleTime(SimStruct *S, int_T k, real_T t) { S->sample = t; }
static void ssSetOffsetTime(SimStruct *S, int_T k, real_T t) { S->offset = t; }
static void ssSetPWorkValue(SimStruct *S, int_T k, void *p) { S->work = p; }
static void *ssGetPWorkValue(SimStruct *S, int_T k) { return S->work; }
static real_T ssGetT(SimStruct *S) { return S->time; }
static real_T *ssGetOutputPortRealSignal(SimStruct *S, int_T k) { return &S->output; }
static InputRealPtrsType ssGetInputPortRealSignalPtrs(SimStruct *S, int_T k) { return &S->input; }
static void ssSetErrorStatus(SimStruct *S, const char *text) { S->error = text; }
static real_T mxGetScalar(const mxArray *a) { return a->number; }
static int mxGetString(const mxArray *a, char *text, size_t size) { return strlen(a->text) >= size ? 1 : (strcpy(text, a->text), 0); }
