/* The memory of arrays that kernels make, as numba's code asks for it; arrays are never handed to Python. */
#include "python.h"
#include "processor.h"
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#define ALIGNMENT 64

EXPORT Python python;
EXPORT const I python_size = sizeof(Python);
EXPORT int has_v3(void) { return is_v3(); }

I items_of(P array) {
  I product = 1;
  for (int k = 0; k < ARRAY(array)->ndim; k++) product *= ARRAY(array)->shape[k];
  return product;
}

P failed(const char *name) {
  char text[200];
  if (python.PyErr_Occurred()) return 0;
  snprintf(text, sizeof text, "the compiled function %s refuses its arguments", name);
  python.PyErr_SetString(python.error, text);
  return 0;
}

P row_of(P row) { /* where the numbers of a row of a table lie, which the caller holds */
  P view[16] = {0}; /* Py_buffer has ten words, the first of them is the address */
  if (python.PyObject_GetBuffer(row, view, 0)) return 0;
  P data = view[0];
  python.PyBuffer_Release(view);
  return data;
}

P nothing(void) {
  python.Py_IncRef(python.none);
  return python.none;
}

P tuple_of(int count, ...) {
  va_list values;
  P found = python.PyTuple_New(count);
  va_start(values, count);
  for (int k = 0; k < count; k++) python.PyTuple_SetItem(found, k, va_arg(values, P));
  va_end(values);
  return found;
}

typedef struct { /* the head of a stretch of memory: numba's code counts who uses it, and reads where the data are */
  size_t users;
  void *dtor, *dtor_info, *data;
  size_t size;
  void *external;
} Memory;

void *NRT_MemInfo_alloc(size_t size) {
  size_t head = sizeof(Memory) + ALIGNMENT;
  char *whole = malloc(head + size);
  Memory *memory = (Memory *)whole;
  if (!whole) return 0;
  *memory = (Memory){.users = 1, .size = size};
  memory->data = (void *)((uintptr_t)(whole + head) & ~(uintptr_t)(ALIGNMENT - 1));
  return memory;
}

void *NRT_MemInfo_alloc_aligned(size_t size, uint32_t align) { return align > ALIGNMENT ? 0 : NRT_MemInfo_alloc(size); }
void NRT_MemInfo_call_dtor(void *memory) { free(memory); }
void *NRT_Allocate(size_t size) { return malloc(size); }
void NRT_Free(void *memory) { free(memory); }

/* Products of matrices, by SciPy's BLAS; only of double precision ('d'). */
int numba_xxgemm(char kind, char a_as, char b_as, I m, I n, I k, P alpha, P a, I lda, P b, I ldb, P beta, P c, I ldc) {
  int sizes[] = {(int)m, (int)n, (int)k, (int)lda, (int)ldb, (int)ldc};
  if (kind != 'd') return -1;
  python.dgemm(&a_as, &b_as, sizes, sizes + 1, sizes + 2, alpha, a, sizes + 3, b, sizes + 4, beta, c, sizes + 5);
  return 0;
}

int numba_xxgemv(char kind, char a_as, I m, I n, P alpha, P a, I lda, P x, P beta, P y) {
  int sizes[] = {(int)m, (int)n, (int)lda, 1};
  if (kind != 'd') return -1;
  python.dgemv(&a_as, sizes, sizes + 1, alpha, a, sizes + 2, x, sizes + 3, beta, y, sizes + 3);
  return 0;
}

int numba_xxdot(char kind, char conjugate, I n, const double *a, const double *b, double *result) {
  *result = 0.0;
  for (I k = 0; k < n; k++) *result += a[k] * b[k];
  return kind == 'd' && !conjugate ? 0 : -1;
}

/* Write the strides of an array in another shape, without a copy; 0 where its rows do not follow each other. */
int numba_attempt_nocopy_reshape(I nd, const I *dims, const I *strides, I new_nd, const I *new_dims, I *new_strides,
                                 I size, int by_columns) {
  I next = size;
  if (by_columns) return 0;
  for (I k = nd - 1; k >= 0; next *= dims[k--])
    if (dims[k] != 1 && strides[k] != next) return 0;
  next = size;
  for (I k = new_nd - 1; k >= 0; next *= new_dims[k--]) new_strides[k] = next;
  return 1;
}

/* Code of exceptions with values, which `failed` does not read, refers to these: nothing calls it. */
#define UNUSED(name) \
  void name(void) { abort(); }
UNUSED(PyErr_SetString)
UNUSED(PyObject_Hash)
UNUSED(PyTuple_Pack)
UNUSED(PyUnicode_FromKindAndData)
UNUSED(Py_FatalError)
UNUSED(numba_gil_ensure)
P PyExc_RuntimeError;
