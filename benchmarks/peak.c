/* Fused multiply-adds per second of one core: independent chains of packs, no memory. WIDE numbers in a pack. */
#include <stdint.h>
#define CHAINS 12
typedef double V __attribute__((vector_size(WIDE * sizeof(double))));

double chains(int64_t n) {
  V a[CHAINS], m = (V){} + 0.9999, c = (V){} + 1e-6;
  for (int i = 0; i < CHAINS; i++) a[i] = (V){} + i * 1e-3;
  for (int64_t k = 0; k < n; k++) {
#pragma GCC unroll 12
    for (int i = 0; i < CHAINS; i++) a[i] = a[i] * m + c;
    /* the compiler must not shorten the loop */
    __asm__ volatile("" : "+x"(a[0]), "+x"(a[1]), "+x"(a[2]), "+x"(a[3]), "+x"(a[4]), "+x"(a[5]));
    __asm__ volatile("" : "+x"(a[6]), "+x"(a[7]), "+x"(a[8]), "+x"(a[9]), "+x"(a[10]), "+x"(a[11]));
  }
  double total = 0.0;
  for (int i = 0; i < CHAINS; i++) for (int l = 0; l < WIDE; l++) total += a[i][l];
  return total;
}
