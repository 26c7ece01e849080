/* Derivatives along a trajectory with orders given tick by tick: adjoint gradient of a misfit, forward tangents, and the
   Jacobians at a point. One trajectory at a time (LANES 1); WIDE directions side by side in the tangents. */
#include <stdint.h>
#include <stdlib.h>
#include "lanes.h"
#include "model.h"
#include "slopes.h"

enum { SX_ = NX + NM }; /* state and memory */
#define PI 3.14159265358979323846
#define LEN(table) ((int)(sizeof(table) / sizeof(table[0])))

typedef struct {
  const double *p;        /* (NP) */
  const double *start;    /* (NX + NM) */
  int64_t ticks, steps;
  double tick;
  const double *orders;   /* (rows, NO) */
  const int64_t *row;     /* (ticks) row of the orders in every tick */
  int64_t channels;
  const int64_t *channel; /* (channels) of the observed ones */
  double *seen;           /* (ticks, channels) out: after every tick */
  const double *measured, *weight; /* (ticks, channels) */
  double *misfit;         /* (1) out: sum of weight (seen - measured)^2; heading differences wrapped */
  double *gradient;       /* (FREE) out */
  double *start_gradient; /* (NX + NM) out */
  int64_t directions;
  const int64_t *direction; /* (directions) parameter, or FREE + place in the start */
  double *tangent;        /* (ticks, channels, directions) out */
} Slope;

INLINE double wrapped(double a) { return a - 2.0 * PI * floor((a + PI) * (0.5 / PI)); }

static const double TO[4] = {0.0, 0.5, 0.5, 1.0}, SHARE[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};

/* Command of a tick. */
static void guide(const double *p, const double *x, const double *m, const double *ref, double *asked, double *rates) {
  double y[NY], granted[3], heading[1];
  observe(p, x, ref, y);
  steer(p, y, m, ref, granted, asked, rates, heading);
}

/* One RK4 step; the four points at which the rates were taken go to at. */
INLINE void step(const double *p, const double *x, const double *asked, double dt, double at[4][NX], double *next) {
  double rate[NX];
  for (int i = 0; i < NX; i++) { next[i] = x[i]; at[0][i] = x[i]; }
#pragma GCC unroll 1
  for (int s = 0; s < 4; s++) {
    if (s) for (int i = 0; i < NX; i++) at[s][i] = x[i] + TO[s] * dt * rate[i];
    dynamics(p, at[s], asked, rate);
    for (int i = 0; i < NX; i++) next[i] += SHARE[s] * dt * rate[i];
  }
}

/* Forward: the four points of every step and the last state (4 * ticks * steps + 1, NX), memories (ticks + 1, NM), commands (ticks, NA). */
static void forward(const Slope *a, double *X, double *M, double *U) {
  double dt = a->tick / (double)a->steps, rates[NM], y[NY];
  memcpy(X, a->start, NX * sizeof(double));
  memcpy(M, a->start + NX, NM * sizeof(double));
  for (int64_t k = 0; k < a->ticks; k++) {
    const double *ref = a->orders + a->row[k] * NO;
    guide(a->p, X, M + k * NM, ref, U + k * NA, rates);
    for (int i = 0; i < NM; i++) M[(k + 1) * NM + i] = M[k * NM + i] + a->tick * rates[i];
    for (int64_t s = 0; s < a->steps; s++, X += 4 * NX) step(a->p, X, U + k * NA, dt, (double(*)[NX])X, X + 4 * NX);
    observe(a->p, X, ref, y);
    for (int64_t c = 0; c < a->channels; c++) a->seen[k * a->channels + c] = y[a->channel[c]];
  }
}

/* What weights ly on the channels mean for the state and the parameters. */
static void look_back(const double *p, const double *x, const double *ref, const double *ly, double *lx, double *theta) {
  double xb[NX], tb[FREE];
  observe_vjp(p, x, ref, ly, xb, tb);
  for (int j = 0; j < observe_vjp0_col[1]; j++) lx[observe_vjp0_row[j]] += xb[j];
  for (int j = 0; j < observe_vjp1_col[1]; j++) theta[observe_vjp1_row[j]] += tb[j];
}

/* Misfit and its gradient by the discrete adjoint of the loop. Returns 0, or 1 without memory. */
__attribute__((visibility("default"))) int misfit(const Slope *a) {
  int64_t n = a->ticks * a->steps;
  double *X = malloc(((4 * n + 1) * NX + (a->ticks + 1) * NM + a->ticks * NA) * sizeof(double));
  if (!X) return 1;
  double *M = X + (4 * n + 1) * NX, *U = M + (a->ticks + 1) * NM, dt = a->tick / (double)a->steps, total = 0.0;
  double lx[NX] = {0}, lm[NM] = {0}, theta[FREE] = {0};
  forward(a, X, M, U);
  for (int64_t k = a->ticks - 1; k >= 0; k--) {
    const double *ref = a->orders + a->row[k] * NO;
    double ly[NS] = {0}, la[NA] = {0}, ab[NA], mb[NM], tb[FREE], back[NM];
    for (int64_t c = 0; c < a->channels; c++) {
      double e = a->seen[k * a->channels + c] - a->measured[k * a->channels + c], w = a->weight[k * a->channels + c];
      if (a->channel[c] == PSI) e = wrapped(e);
      if (w == 0.0) continue;
      total += w * e * e;
      ly[a->channel[c]] += 2.0 * w * e;
    }
    look_back(a->p, X + (k + 1) * a->steps * 4 * NX, ref, ly, lx, theta);
    for (int64_t s = a->steps - 1; s >= 0; s--) {
      const double *at = X + (k * a->steps + s) * 4 * NX;
      double l[NX], yb[NX] = {0}, sum[NX];
      memcpy(sum, lx, sizeof sum);
#pragma GCC unroll 1
      for (int g = 3; g >= 0; g--) {
        double share = SHARE[g] * dt, on = g < 3 ? TO[g + 1] * dt : 0.0;
        for (int i = 0; i < NX; i++) l[i] = share * lx[i] + on * yb[i];
        dynamics_vjp(a->p, at + g * NX, U + k * NA, l, yb, ab, tb);
        for (int i = 0; i < NA; i++) la[i] += ab[i];
        for (int i = 0; i < FREE; i++) theta[i] += tb[i];
        for (int i = 0; i < NX; i++) sum[i] += yb[i];
      }
      memcpy(lx, sum, sizeof sum);
    }
    for (int i = 0; i < NM; i++) back[i] = a->tick * lm[i];
    double seen[NY], yb[NS], none[NS] = {0};
    observe(a->p, X + k * a->steps * 4 * NX, ref, seen);
    steer_vjp(a->p, seen, M + k * NM, ref, la, back, yb, mb, tb);
    for (int j = 0; j < steer_vjp0_col[1]; j++) none[steer_vjp0_row[j]] = yb[j];
    for (int j = 0; j < steer_vjp1_col[1]; j++) lm[steer_vjp1_row[j]] += mb[j];
    for (int j = 0; j < steer_vjp2_col[1]; j++) theta[steer_vjp2_row[j]] += tb[j];
    look_back(a->p, X + k * a->steps * 4 * NX, ref, none, lx, theta);
  }
  *a->misfit = total;
  memcpy(a->gradient, theta, sizeof theta);
  memcpy(a->start_gradient, lx, sizeof lx);
  memcpy(a->start_gradient + NX, lm, sizeof lm);
  free(X);
  return 0;
}

typedef double V __attribute__((vector_size(WIDE * sizeof(double)), aligned(8)));
#define ALL(v) ((V){} + (double)(v))

/* out += J in for a sparse Jacobian by columns. Inlined with constant tables: straight-line code. */
INLINE void times(int columns, const int *col, const int *row, const double *J, const V *in, V *out) {
#pragma GCC unroll 32
  for (int c = 0; c < columns; c++)
#pragma GCC unroll 32
    for (int j = col[c]; j < col[c + 1]; j++) out[row[j]] += ALL(J[j]) * in[c];
}

#define TIMES(name, columns, J, in, out) times(columns, name##_col, name##_row, J, in, out)

/* Column d of a sparse Jacobian with respect to the parameters, into lane l of out. */
INLINE void column(const int *col, const int *row, const double *J, int64_t d, int l, V *out) {
  if (d < FREE) for (int j = col[d]; j < col[d + 1]; j++) out[row[j]][l] += J[j];
}

/* Sparse Jacobians at a point of a step: direct by state, command, parameters; load by state, parameters. */
typedef struct {
  double dx[LEN(dynamics_jac0_row)], da[LEN(dynamics_jac1_row)], dt[LEN(dynamics_jac2_row)];
  double lx[LEN(dynamics_jac3_row)], lt[LEN(dynamics_jac4_row)];
} Local;

/* What the parameters of a pack of directions do to the rates and to the load at a point. */
typedef struct { V rate[NX], load[6]; } Drive;

/* Fill the drives of all packs at a point. The places filled are the same at every point, so the others stay zero.
   Filled for all packs before any is used: a pack that is read right after its lanes were written stalls. */
static void fill(const Local *j, const int64_t *direction, int64_t directions, Drive *out) {
  for (int64_t i = 0; i < directions; i++) {
    int64_t d = direction[i];
    if (d >= FREE) continue;
    double *rate = (double *)out[i / WIDE].rate + i % WIDE, *load = (double *)out[i / WIDE].load + i % WIDE;
    for (int c = dynamics_jac2_col[d]; c < dynamics_jac2_col[d + 1]; c++) rate[dynamics_jac2_row[c] * WIDE] = j->dt[c];
    for (int c = dynamics_jac4_col[d]; c < dynamics_jac4_col[d + 1]; c++) load[dynamics_jac4_row[c] * WIDE] = j->lt[c];
  }
}

/* Tangent of the rates: direct + W load. */
INLINE void rates_tangent(const double *W, const Local *j, const Drive *drive, const V *x, const V *asked, V *rate) {
  V load[6];
  for (int i = 0; i < NX; i++) rate[i] = drive->rate[i];
  for (int i = 0; i < 6; i++) load[i] = drive->load[i];
  TIMES(dynamics_jac0, NX, j->dx, x, rate);
  TIMES(dynamics_jac1, NA, j->da, asked, rate);
  TIMES(dynamics_jac3, NX, j->lx, x, load);
  for (int i = 0; i < 6; i++)
    for (int k = 0; k < 6; k++) rate[7 + i] += ALL(W[6 * i + k]) * load[k];
}

/* Tangents of one step of RK4 in a pack of directions; drive[0], drive[stride], ... belong to its four points. */
static __attribute__((noinline)) void step_tangent(const double *W, const Local *j, const Drive *drive, int64_t stride, double dt, V *x, const V *asked) {
  V sum[NX], rate[NX], at[NX];
  for (int i = 0; i < NX; i++) { sum[i] = x[i]; at[i] = x[i]; }
#pragma GCC unroll 1
  for (int g = 0; g < 4; g++) {
    rates_tangent(W, j + g, drive + g * stride, at, asked, rate);
    double on = g < 3 ? TO[g + 1] * dt : 0.0;
    for (int i = 0; i < NX; i++) { sum[i] += ALL(SHARE[g] * dt) * rate[i]; at[i] = x[i] + ALL(on) * rate[i]; }
  }
  for (int i = 0; i < NX; i++) x[i] = sum[i];
}

/* A pack of directions: tangents of state, memory and command. */
typedef struct { V x[NX], m[NM], asked[NA]; } Directions;

/* Tangents of the observed channels (NS) in a pack. */
INLINE void seen_tangent(const double *yx, const double *yt, const int64_t *direction, int lanes, const V *x, V *out) {
  for (int i = 0; i < NS; i++) out[i] = ALL(0.0);
  for (int l = 0; l < lanes; l++) column(observe_jac1_col, observe_jac1_row, yt, direction[l], l, out);
  TIMES(observe_jac0, NX, yx, x, out);
}

/* Tangents of the command of a tick and of the memory after it. */
static void guide_tangent(const Slope *a, const double *x, const double *m, const double *ref, Directions *D, int64_t packs) {
  double y[NY], yx[LEN(observe_jac0_row)], yt[LEN(observe_jac1_row)];
  double gy[LEN(steer_jac0_row)], gm[LEN(steer_jac1_row)], gt[LEN(steer_jac2_row)];
  observe(a->p, x, ref, y);
  observe_jac(a->p, x, ref, yx, yt);
  steer_jac(a->p, y, m, ref, gy, gm, gt);
  for (int64_t q = 0; q < packs; q++) {
    int lanes = (int)(a->directions - q * WIDE < WIDE ? a->directions - q * WIDE : WIDE);
    const int64_t *direction = a->direction + q * WIDE;
    V seen[NS], out[NA + NM];
    for (int i = 0; i < NA + NM; i++) out[i] = ALL(0.0);
    seen_tangent(yx, yt, direction, lanes, D[q].x, seen);
    for (int l = 0; l < lanes; l++) column(steer_jac2_col, steer_jac2_row, gt, direction[l], l, out);
    TIMES(steer_jac0, NS, gy, seen, out);
    TIMES(steer_jac1, NM, gm, D[q].m, out);
    for (int i = 0; i < NA; i++) D[q].asked[i] = out[i];
    for (int i = 0; i < NM; i++) D[q].m[i] += ALL(a->tick) * out[NA + i];
  }
}

/* Channels and their tangents after tick k. */
static void tangents_out(const Slope *a, int64_t k, const double *x, const double *ref, const Directions *D, int64_t packs) {
  double y[NY], yx[LEN(observe_jac0_row)], yt[LEN(observe_jac1_row)];
  observe(a->p, x, ref, y);
  observe_jac(a->p, x, ref, yx, yt);
  for (int64_t c = 0; c < a->channels; c++) a->seen[k * a->channels + c] = y[a->channel[c]];
  for (int64_t q = 0; q < packs; q++) {
    int lanes = (int)(a->directions - q * WIDE < WIDE ? a->directions - q * WIDE : WIDE);
    V out[NS];
    seen_tangent(yx, yt, a->direction + q * WIDE, lanes, D[q].x, out);
    for (int64_t c = 0; c < a->channels; c++)
      for (int l = 0; l < lanes; l++)
        a->tangent[(k * a->channels + c) * a->directions + q * WIDE + l] = out[a->channel[c]][l];
  }
}

/* Tangents of the observed channels along the trajectory in the chosen directions. Returns 0, or 1 without memory. */
__attribute__((visibility("default"))) int tangents(const Slope *a) {
  int64_t packs = (a->directions + WIDE - 1) / WIDE;
  double dt = a->tick / (double)a->steps, x[NX], m[NM], asked[NA], rates[NM];
  size_t size = packs * (sizeof(Directions) + 4 * sizeof(Drive)) + 64;
  Directions *D = aligned_alloc(64, (size + 63) / 64 * 64);
  Local local[4];
  if (!D) return 1;
  memset(D, 0, size);
  Drive *drive = (Drive *)(D + packs);
  memcpy(x, a->start, sizeof x);
  memcpy(m, a->start + NX, sizeof m);
  for (int64_t d = 0; d < a->directions; d++)
    if (a->direction[d] >= FREE) {
      Directions *pack = D + d / WIDE;
      int64_t place = a->direction[d] - FREE;
      if (place < NX) pack->x[place][d % WIDE] = 1.0;
      else pack->m[place - NX][d % WIDE] = 1.0;
    }
  for (int64_t k = 0; k < a->ticks; k++) {
    const double *ref = a->orders + a->row[k] * NO;
    guide(a->p, x, m, ref, asked, rates);
    guide_tangent(a, x, m, ref, D, packs);
    for (int i = 0; i < NM; i++) m[i] += a->tick * rates[i];
    for (int64_t s = 0; s < a->steps; s++) {
      double at[4][NX], next[NX];
      step(a->p, x, asked, dt, at, next);
#pragma GCC unroll 1
      for (int g = 0; g < 4; g++) {
        dynamics_jac(a->p, at[g], asked, local[g].dx, local[g].da, local[g].dt, local[g].lx, local[g].lt);
        fill(local + g, a->direction, a->directions, drive + g * packs);
      }
      for (int64_t q = 0; q < packs; q++) step_tangent(a->p + INVERSE, local, drive + q, packs, dt, D[q].x, D[q].asked);
      memcpy(x, next, sizeof x);
    }
    tangents_out(a, k, x, ref, D, packs);
  }
  free(D);
  return 0;
}

/* Rates and their Jacobians at `count` points: A (count, NX, NX), B (count, NX, NA), G (count, NX, FREE); zero before.
   p_stride : NP, or 0 when the points share their parameters. */
__attribute__((visibility("default"))) void jacobians(int64_t count, const double *p, int64_t p_stride, const double *x,
                                                      const double *asked, double *rates, double *A, double *B, double *G) {
  for (int64_t n = 0; n < count; n++, p += p_stride, x += NX, asked += NA, rates += NX, A += NX * NX, B += NX * NA, G += NX * FREE) {
    Local j;
    const double *W = p + INVERSE;
    dynamics(p, x, asked, rates);
    dynamics_jac(p, x, asked, j.dx, j.da, j.dt, j.lx, j.lt);
#define SCATTER(name, columns, J, out) \
    for (int c = 0; c < columns; c++) for (int i = name##_col[c]; i < name##_col[c + 1]; i++) out[name##_row[i] * columns + c] += J[i];
#define THROUGH(name, columns, J, out) \
    for (int c = 0; c < columns; c++) for (int i = name##_col[c]; i < name##_col[c + 1]; i++) \
      for (int r = 0; r < 6; r++) out[(7 + r) * columns + c] += W[6 * r + name##_row[i]] * J[i];
    SCATTER(dynamics_jac0, NX, j.dx, A)
    SCATTER(dynamics_jac1, NA, j.da, B)
    SCATTER(dynamics_jac2, FREE, j.dt, G)
    THROUGH(dynamics_jac3, NX, j.lx, A)
    THROUGH(dynamics_jac4, FREE, j.lt, G)
  }
}
