/* Whether the processor has AVX2 and FMA with what belongs to them: x86-64-v3, as LLVM has it. */
#ifndef MODALPREP_PROCESSOR_H
#define MODALPREP_PROCESSOR_H
#ifdef __x86_64__
#include <cpuid.h>
#define LEAF_1 (1u << 12 | 1u << 22 | 1u << 27 | 1u << 28 | 1u << 29) /* FMA, MOVBE, OSXSAVE, AVX, F16C */
#define LEAF_7 (1u << 3 | 1u << 5 | 1u << 8)                          /* BMI1, AVX2, BMI2 */
static int saves_wide_registers(void) {
  unsigned low, high;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return (low & 6) == 6;
}
static int is_v3(void) {
  unsigned a, b, c, d;
  if (!__get_cpuid(1, &a, &b, &c, &d) || (c & LEAF_1) != LEAF_1 || !saves_wide_registers()) return 0;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & LEAF_7) != LEAF_7) return 0;
  return __get_cpuid(0x80000001, &a, &b, &c, &d) && (c & 1u << 5); /* LZCNT */
}
#else
static int is_v3(void) { return 0; }
#endif
#endif
