/* Numbers of one trajectory (LANES 1) or of LANES trajectories side by side, for the generated model text.

   T      a number, or a pack in the compiler's vector type; no auto-vectoriser is relied on.
   Truth values are 0.0 and 1.0. One trajectory uses the C library's sine, cosine and arc tangent. Packs use plain
   arithmetic, the same on every target:
   SINCOS : Cody and Waite reduction by pi/2 in three parts, fdlibm's kernel polynomials; |a| below about 1e5 rad.
   ATAN2  : Cephes' rational approximation on |t| <= 0.66, reduction by pi/4. */
#include <math.h>
#include <string.h>

#if LANES == 1
typedef double T;
#define C(v) ((T)(v))
#define LANE(v, l) (v)
#else
typedef double T __attribute__((vector_size(LANES * sizeof(double))));
#define C(v) ((T){} + (double)(v))
#define LANE(v, l) ((v)[l])
#endif

#define EACH(l) for (int l = 0; l < LANES; l++)
#define INLINE static inline __attribute__((always_inline))

#if LANES == 1
#define ABS fabs
#define FLOOR floor
#define SQRT sqrt
#define ATAN2 atan2
INLINE T MIN(T a, T b) { return a < b ? a : b; }
INLINE T MAX(T a, T b) { return a > b ? a : b; }
INLINE T SIGN(T a) { return (T)(a > 0) - (T)(a < 0); }
INLINE T LESS(T a, T b) { return (T)(a < b); }
INLINE T LEQ(T a, T b) { return (T)(a <= b); }
INLINE T SAME(T a, T b) { return (T)(a == b); }
INLINE T WHERE(T c, T a) { return c != 0.0 ? a : 0.0; }
INLINE T PICK(T c, T a, T b) { return c != 0.0 ? a : b; }
INLINE void SINCOS(T a, T *s, T *c) { *s = sin(a); *c = cos(a); }
#else
#define BY_LANE(expression) { T r; EACH(i) r[i] = (expression); return r; }
INLINE T ABS(T a) BY_LANE(__builtin_fabs(a[i]))
INLINE T FLOOR(T a) BY_LANE(__builtin_floor(a[i]))
INLINE T SQRT(T a) BY_LANE(__builtin_sqrt(a[i]))
INLINE T MIN(T a, T b) BY_LANE(a[i] < b[i] ? a[i] : b[i])
INLINE T MAX(T a, T b) BY_LANE(a[i] > b[i] ? a[i] : b[i])
INLINE T SIGN(T a) BY_LANE((double)(a[i] > 0) - (double)(a[i] < 0))
INLINE T LESS(T a, T b) BY_LANE(a[i] < b[i] ? 1.0 : 0.0)
INLINE T LEQ(T a, T b) BY_LANE(a[i] <= b[i] ? 1.0 : 0.0)
INLINE T SAME(T a, T b) BY_LANE(a[i] == b[i] ? 1.0 : 0.0)
INLINE T WHERE(T c, T a) BY_LANE(c[i] != 0.0 ? a[i] : 0.0)
INLINE T PICK(T c, T a, T b) BY_LANE(c[i] != 0.0 ? a[i] : b[i])

INLINE void SINCOS(T a, T *s, T *c) {
  T k = FLOOR(a * C(0.6366197723675814) + C(0.5));
  T y = ((a - k * C(1.5707963267341256)) - k * C(6.077100506303966e-11)) - k * C(2.0222662487959506e-21), q = y * y;
  T sine = y + y * q * (C(-1.66666666666666324348e-01) + q * (C(8.33333333332248946124e-03)
      + q * (C(-1.98412698298579493134e-04) + q * (C(2.75573137070700676789e-06)
      + q * (C(-2.50507602534068634195e-08) + q * C(1.58969099521155010221e-10))))));
  T cosine = C(1.0) - C(0.5) * q + q * q * (C(4.16666666666666019037e-02) + q * (C(-1.38888888888741095749e-03)
      + q * (C(2.48015872894767294178e-05) + q * (C(-2.75573143513906633035e-07)
      + q * (C(2.08757232129817482790e-09) - q * C(1.13596475577881948265e-11))))));
  T half = k * C(0.5), odd = (half - FLOOR(half)) * C(2.0); /* k odd: sine and cosine change places */
  T turn = (half - odd * C(0.5)) * C(0.5), back = (turn - FLOOR(turn)) * C(2.0); /* k mod 4 in {2, 3} */
  T sign = C(1.0) - C(2.0) * back;
  *s = sign * PICK(odd, cosine, sine);
  *c = sign * (C(1.0) - C(2.0) * odd) * PICK(odd, sine, cosine);
}

INLINE T ATAN2(T y, T x) {
  T ax = ABS(x), ay = ABS(y), steep = LESS(ax, ay);
  T low = MIN(ax, ay), high = MAX(ax, ay);
  high = high + SAME(high, C(0.0)); /* atan2(0, 0) = 0 */
  T t = low / high, far = LESS(C(0.4142135623730950488), t);
  T u = PICK(far, (t - C(1.0)) / (t + C(1.0)), t), q = u * u;
  T above = (((C(-8.750608600031904122785e-1) * q - C(1.615753718733365076637e1)) * q - C(7.500855792314704667340e1)) * q
      - C(1.228866684490136173410e2)) * q - C(6.485021904942025371773e1);
  T below = ((((q + C(2.485846490142306297962e1)) * q + C(1.650270098316988542046e2)) * q
      + C(4.328810604912902668951e2)) * q + C(4.853903996359136964868e2)) * q + C(1.945506571482613964425e2);
  T angle = u + u * q * (above / below) + WHERE(far, C(0.78539816339744830962));
  angle = PICK(steep, C(1.57079632679489661923) - angle, angle);
  angle = PICK(LESS(x, C(0.0)), C(3.14159265358979323846) - angle, angle);
  return PICK(LESS(y, C(0.0)), -angle, angle);
}
#endif

INLINE int any(T c) {
  EACH(l) if (LANE(c, l) != 0.0) return 1;
  return 0;
}
