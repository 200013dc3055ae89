/* A system without Python: the image of its packed records, and what the compiled kernels do with it. */
#ifndef MODALPREP_CORE_H
#define MODALPREP_CORE_H
#include <stddef.h>
#include <stdint.h>

enum { FAILED, DONE, UNDERWAY };
enum { NEWS, ERRORS, WARNINGS, SAYINGS }; /* of what is said */
enum { TIME = 0, STATE = 0x1000000, RATE = 0x2000000, CHANNEL = 0x3000000, COMBINED = 0x4000000, GIVEN = 0x5000000,
       GIVEN_RATE = 0x6000000, GIVEN_ACCELERATION = 0x7000000, INDICATOR = 0x8000000 };
enum { KIND_OF_VARIABLE = 0x7f000000, NUMBER_OF_VARIABLE = 0xffffff };
typedef int64_t I;
typedef void (*Say)(void *instance, int level, const char *text);

/* The head of model.bin, words of eight bytes; runtime/model.py writes it. Places are in bytes of the image. */
typedef struct {
  char magic[8], token[64];
  I image, relocations, states, width, combined, terms, given, inputs, places, stretches, middles, indicators,
    codes;                                                                                         /* sizes */
  I method, may_change, bounded;                                                                   /* of the run */
  I equations, run, watch, outside, y, state, ydot, row, time, rtol,
    looks, sine;                                                                                   /* places */
  I slopes, slope_relocations, tangent, seed, found; /* of the image for directional derivatives; no bytes: without */
} Head;
/* An input or a parameter, and its places; moves: of a prescribed motion, whose rate and acceleration are inputs too. */
typedef struct { I first, count, moves; double start; } Given;
typedef struct { I at; double factor, later; } Place; /* later: s, of the knot of an input after the first; -1: no knot */
typedef struct { I column; double factor; } Term; /* of a combination of channels */
typedef struct { double begin, end; } Stretch;    /* between breaks of functions of time, s */
typedef struct { I operation; double number; } Code; /* of an expression, its operands first */
typedef struct { I first, count, direction, terminal; char name[64]; } Indicator; /* codes; the event */

typedef struct {
  char *file;
  const Head *head;
  const char *image, *slopes;
  const I *relocations, *slope_relocations, *combined, *middles;
  const Given *given;
  const Place *places;
  const Term *terms;
  const Stretch *stretches;
  const Indicator *indicators;
  const Code *codes;
  const double *nominals;
} Model;

typedef struct {
  Model model;
  char *raw, *memory; /* the image, its addresses put right */
  char *raw_slopes, *slopes; /* that for directional derivatives */
  double *given; /* values of inputs and parameters, rates, accelerations, times at which these were given */
  double *side;  /* signs of the indicators at the last event, behind those */
  char *back;    /* the last state before a step that may pass an event which ends the run */
  double t, before;   /* s, now and at the last completed step */
  I stretch, method;
  int derived, observed, differentiated, restart, changeable; /* changeable: states and parameters may be set */
  int exchange, ended;                        /* model exchange; an event has ended the run */
  void *owner;
  Say say;
} Core;

Core *core_new(const char *file, const char *token, void *owner, Say say);
void core_free(Core *core);
void core_reset(Core *core);
void core_tolerance(Core *core, double rtol);
int core_initialise(Core *core);
int core_get(Core *core, uint32_t reference, double *value);
int core_set(Core *core, uint32_t reference, double value);
void core_time(Core *core, double t);
void core_put_states(Core *core, const double *y);
void core_get_states(Core *core, double *y);
int core_rates(Core *core, double *ydot);
int core_completed(Core *core);
int core_next_stretch(Core *core);
double core_next_break(Core *core);
int core_step(Core *core, double end);
int core_advance(Core *core, double end, int once);
double *core_input(Core *core, I k);
void core_put_input(Core *core, I k, double value);
int core_differentiate(Core *core);
void core_follow(Core *core);
int core_directional(Core *core, const uint32_t unknown[], size_t nu, const uint32_t known[], size_t nk,
                     const double seed[], double found[]);
int core_set_derivative(Core *core, uint32_t reference, int order, double value);
int core_observe(Core *core);
int core_indicators(Core *core, double *values);
int core_indicator(Core *core, I k, double *value);
int core_events(Core *core);
void core_begin_events(Core *core);
int core_watches(Core *core);
int core_advance_to_event(Core *core, double end);
size_t core_saved_size(Core *core);
void core_save(Core *core, char *to);
int core_restore(Core *core, const char *from, size_t size);
#endif
