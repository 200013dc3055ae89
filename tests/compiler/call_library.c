/* Calls a kernel of a library of compiled kernels without Python: program LIBRARY SYMBOL A B prints whether A <= B.
   The functions of Python and the array are stand-ins, of which the kernel uses few. */
#include "../../src/modalprep/compiler/c/python.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define FIND(library, name) ((P)GetProcAddress(library, name))
#define LOAD(path) LoadLibraryA(path)
#else
#include <dlfcn.h>
#define FIND(library, name) dlsym(library, name)
#define LOAD(path) dlopen(path, RTLD_NOW)
#endif

static P truth(long value) { return (P)(value ? "yes" : "no"); }
static P no_error(void) { return 0; }
static P save(void) { return 0; }
static void restore(P thread) {}

typedef struct {
  char head[16];
  Array array;
} Object;

int main(int count, char **given) {
  double values[2] = {atof(given[3]), atof(given[4])};
  I shape = 2, stride = 8;
  Object a = {"", {(char *)values, 1, &shape, &stride}};
  P arguments[1] = {&a};
  P library = LOAD(given[1]);
  if (!library) return fprintf(stderr, "cannot load %s\n", given[1]), 2;
  if (*(I *)FIND(library, "python_size") != sizeof(Python)) return 3;
  Python table;
  memset(&table, 0, sizeof table);
  table.PyBool_FromLong = truth;
  table.PyErr_Occurred = no_error;
  table.PyEval_SaveThread = save;
  table.PyEval_RestoreThread = restore;
  table.head = sizeof a.head;
  memcpy(FIND(library, "python"), &table, sizeof table);
  P (*call)(P, P *, I) = (P (*)(P, P *, I))FIND(library, given[2]);
  P found = call ? call(0, arguments, 1) : 0;
  return found ? puts(found) < 0 : 4;
}
