/* What calls of compiled kernels need of Python, NumPy and numba. Python's functions are given at load, so that the
   library serves every version of it: library.py, in the order of this table. */
#ifndef MODALPREP_PYTHON_H
#define MODALPREP_PYTHON_H
#include <stdint.h>

typedef int64_t I;
typedef void *P;
typedef struct {
  P (*PyFloat_FromDouble)(double);
  P (*PyLong_FromLongLong)(I);
  P (*PyBool_FromLong)(long);
  P (*PyTuple_New)(I);
  int (*PyTuple_SetItem)(P, I, P);
  P (*PyTuple_GetItem)(P, I);
  double (*PyFloat_AsDouble)(P);
  I (*PyNumber_AsSsize_t)(P, P);
  int (*PyObject_IsTrue)(P);
  int (*PyObject_GetBuffer)(P, P, int);
  void (*PyBuffer_Release)(P);
  P (*PyErr_Occurred)(void);
  void (*PyErr_SetString)(P, const char *);
  P (*PyEval_SaveThread)(void);
  void (*PyEval_RestoreThread)(P);
  void (*Py_IncRef)(P);
  void (*dgemm)(char *, char *, int *, int *, int *, P, P, int *, P, int *, P, P, int *); /* of SciPy */
  void (*dgemv)(char *, int *, int *, P, P, int *, P, int *, P, P, int *);
  P error; /* ValueError */
  P none;
  I head;  /* bytes before what an array says of itself */
} Python;
extern Python python;

typedef struct {
  char *data;
  int ndim;
  I *shape, *strides;
} Array; /* as NumPy has it, after the head of the object */

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define ARRAY(o) ((Array *)((char *)(o) + python.head))
#define REAL(o) python.PyFloat_AsDouble(o)
#define WHOLE(o) python.PyNumber_AsSsize_t(o, 0)
#define TRUTH(o) ((char)python.PyObject_IsTrue(o))
#define ADDRESS(o) ((P)WHOLE(o))
#define PART(o, k) python.PyTuple_GetItem(o, k)
#define DATA(o) ARRAY(o)->data
#define SHAPE(o, k) ARRAY(o)->shape[k]
#define STRIDE(o, k) ARRAY(o)->strides[k]
#define NONE -2 /* numba's status of a function that returns None */
I items_of(P array);
P row_of(P row);
P nothing(void);
P tuple_of(int count, ...);
P failed(const char *name);
#endif
