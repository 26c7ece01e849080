/* Fused multiply-adds per second of one core: twelve independent chains of packs in registers. WIDE numbers in a pack. */
#include <stdint.h>
typedef double V __attribute__((vector_size(WIDE * sizeof(double))));

#define EACH(F) F(0) F(1) F(2) F(3) F(4) F(5) F(6) F(7) F(8) F(9) F(10) F(11)

double chains(int64_t n) {
  V m = (V){} + 0.9999, c = (V){} + 1e-6, total = (V){};
#define BEGIN(i) V a##i = (V){} + i * 1e-3;
  EACH(BEGIN)
  for (int64_t k = 0; k < n; k++) {
#define STEP(i) a##i = a##i * m + c;
    EACH(STEP)
    /* the compiler must not shorten the loop */
    __asm__ volatile("" ::"x"(a0), "x"(a1), "x"(a2), "x"(a3), "x"(a4), "x"(a5));
  }
#define ADD(i) total += a##i;
  EACH(ADD)
  double sum = 0.0;
  for (int l = 0; l < WIDE; l++) sum += total[l];
  return sum;
}
