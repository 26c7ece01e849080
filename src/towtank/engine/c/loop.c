/* Trajectories in packs: observe, steer, integrate; legs, events, gauges and the log.
   model.h gives NP NX NM NO NY NS NF NA PSI DELTA SPEED and dynamics, observe, steer. */
#include <stddef.h>
#include "task.h"
#include "lanes.h"
#include "model.h"

enum { HEAD = LEG_HEAD, MOST = 32, SEARCH = 12 };
#define EPS 1e-9
#define PI 3.14159265358979323846

/* One lane set of trajectories. */
typedef struct {
  T p[NP], x[NX], m[NM], y[NY], ref[NO];
  T granted[3], asked[NA], rates[NM];
  T answered[NF];                       /* fin angles the actuators have answered */
  T held[NSEEN];                        /* what the sensors have read */
  T t, end, live;                       /* time, end of the leg, 1.0 while running */
  T channel, absolute, level, side;     /* event of the leg, and the side of it the leg began on; 0.0 on the level itself */
  T fastest;
  int64_t leg[LANES], at[LANES];
  T stat[MOST][STATS];
} Pack;

INLINE T wrapped(T a) { return a - C(2.0 * PI) * FLOOR((a + C(PI)) * C(0.5 / PI)); }

/* RK4 over h in n equal steps with the command held. */
static __attribute__((noinline)) void advance(const T *restrict p, T *restrict x, const T *restrict asked, T h, int64_t n) {
  static const double to[4] = {0.5, 0.5, 1.0, 0.0}, share[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
  T dt = h * C(1.0 / (double)n);
  for (int64_t k = 0; k < n; k++) {
    T y[NX], sum[NX], rate[NX];
    for (int i = 0; i < NX; i++) { y[i] = x[i]; sum[i] = C(0.0); }
#pragma GCC unroll 1
    for (int s = 0; s < 4; s++) {
      dynamics(p, y, asked, rate);
      T on = dt * C(to[s]), by = dt * C(share[s]);
      for (int i = 0; i < NX; i++) { sum[i] += by * rate[i]; y[i] = x[i] + on * rate[i]; }
    }
    for (int i = 0; i < NX; i++) x[i] += sum[i];
  }
}

/* Channels of the state; heading unwrapped from and fin travel added to those before. */
INLINE void look(const Pack *k, const T *before, T *y) {
  observe(k->p, k->x, k->ref, y);
  y[PSI] = before[PSI] + wrapped(y[PSI] - before[PSI]);
  T travel = C(0.0);
  for (int i = 0; i < NF; i++) travel += ABS(y[DELTA + i] - before[DELTA + i]);
  y[NS + 7] = before[NS + 7] + travel * k->p[FIN_SHARE];
}

INLINE void keep(const Pack *k, T *y) {
  for (int i = 0; i < 3; i++) { y[NS + i] = k->granted[i]; y[NS + 4 + i] = k->m[i]; }
}

#if LANES == 1
#define SET(v, l, value) ((v) = (value))
#else
#define SET(v, l, value) ((v)[l] = (value))
#endif

INLINE uint64_t mixed(uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

/* A standard normal number of a trajectory's sensor and reading: splitmix64 of their numbers, Box and Muller. */
static double normal(int64_t seed, int64_t at, int64_t sensor, int64_t reading) {
  uint64_t z = (uint64_t)seed * 0xD1342543DE82EF95u + (uint64_t)at * 0x9FB21C651E98DF25u
      + (uint64_t)sensor * 0xC2B2AE3D27D4EB4Fu + (uint64_t)reading * 0x165667B19E3779F9u;
  double u = ((double)(mixed(z + 0x9E3779B97F4A7C15u) >> 11) + 0.5) * 0x1p-53;
  double v = (double)(mixed(z + 0x3C6EF372FE94F82Au) >> 11) * 0x1p-53;
  return sqrt(-2.0 * log(u)) * cos(2.0 * PI * v);
}

/* True for a channel that the pilot sees as it is. */
INLINE int exact(const double *sensor) { return sensor[0] == 1.0 && sensor[1] == 0.0 && sensor[2] == 0.0; }

/* The readings that are due in tick n. */
static void sense(const Task *a, Pack *k, int64_t n) {
  if (!a->sensors) return;
  for (int s = 0; s < NSEEN; s++) {
    const double *sensor = a->sensors + 3 * s;
    int64_t every = (int64_t)sensor[0];
    if (exact(sensor) || n % every) continue;
    EACH(l) {
      double off = sensor[1] * normal(a->seed, k->at[l], s, n / every + 1) + sensor[2] * normal(a->seed, k->at[l], s, 0);
      SET(k->held[s], l, LANE(k->y[SEEN_AT[s]], l) + off);
    }
  }
}

/* New orders and command for the lanes in c. */
static __attribute__((noinline)) void order(const Task *a, Pack *k, T c) {
  T granted[3], asked[NA], rates[NM], heading[1], seen[NY];
  memcpy(seen, k->y, sizeof seen);
  if (a->sensors)
    for (int s = 0; s < NSEEN; s++) if (!exact(a->sensors + 3 * s)) seen[SEEN_AT[s]] = k->held[s];
  steer(k->p, seen, k->m, k->ref, granted, asked, rates, heading);
  for (int i = 0; i < 3; i++) k->granted[i] = PICK(c, granted[i], k->granted[i]);
  for (int i = 0; i < NF; i++) { /* a change below the dead band is not answered, then the play is taken up */
    T want = PICK(LESS(k->p[DEAD_BAND + i], ABS(asked[i] - k->answered[i])), asked[i], k->answered[i]);
    k->answered[i] = PICK(c, want, k->answered[i]);
    asked[i] = MAX(want - k->p[BACKLASH + i], MIN(want + k->p[BACKLASH + i], k->asked[i]));
  }
  for (int i = 0; i < NA; i++) k->asked[i] = PICK(c, asked[i], k->asked[i]);
  for (int i = 0; i < NM; i++) k->rates[i] = PICK(c, rates[i], k->rates[i]);
  k->y[NS + 3] = PICK(c, heading[0], k->y[NS + 3]);
  T y[NY];
  keep(k, y);
  for (int i = NS; i < NS + 7; i++) if (i != NS + 3) k->y[i] = PICK(c, y[i], k->y[i]);
}

/* Distance of the event channel from its level, lane by lane. */
INLINE T event(const Pack *k, const T *y) {
  T v = C(0.0);
#if LANES == 1
  if (k->channel >= 0.0) v = y[(int)k->channel];
#else
  EACH(l) if (k->channel[l] >= 0.0) v[l] = y[(int)k->channel[l]][l];
#endif
  return PICK(k->absolute, ABS(v), v) - k->level;
}

/* Side of its level an event stands on; round-off of the search that ended the leg before counts as on the level. */
INLINE T side_of(T e) { return WHERE(LESS(C(EPS), ABS(e)), SIGN(e)); }

static void fresh(const Task *a, Pack *k, int l) {
  double nan = __builtin_nan("");
  for (int64_t g = 0; g < a->gauges; g++) {
    double v = LANE(k->y[(int)a->gauge[3 * g]], l);
    if (a->gauge[3 * g + 1] != 0.0) v = fabs(v);
    double first[STATS] = {v, LANE(k->t, l), v, LANE(k->t, l), 0, 0, 0, nan, nan};
    for (int s = 0; s < STATS; s++) SET(k->stat[g][s], l, first[s]);
  }
}

/* Begin the leg the lane stands at, or end the lane when there is none. */
static void begin(const Task *a, Pack *k, int l) {
  if (k->leg[l] >= a->legs) { SET(k->live, l, 0.0); return; }
  const double *row = a->plan + k->at[l] * a->plan_stride + k->leg[l] * (HEAD + NO);
  SET(k->end, l, LANE(k->t, l) + row[0]);
  SET(k->channel, l, row[1]); SET(k->absolute, l, row[2]); SET(k->level, l, row[3]);
  for (int i = 0; i < NO; i++) SET(k->ref[i], l, row[HEAD + i]);
  SET(k->side, l, LANE(side_of(event(k, k->y)), l));
  fresh(a, k, l);
}

/* End of a leg in lane l: its mark and gauges go out. */
static void finish(const Task *a, Pack *k, int l, int how) {
  int64_t i = k->at[l], leg = k->leg[l];
  if (a->marks) {
    double *out = a->marks + (i * a->legs + leg) * (2 + NY);
    out[0] = LANE(k->t, l); out[1] = how;
    for (int c = 0; c < NY; c++) out[2 + c] = LANE(k->y[c], l);
  }
  if (a->stats)
    for (int64_t g = 0; g < a->gauges; g++)
      for (int s = 0; s < STATS; s++)
        a->stats[((i * a->legs + leg) * a->gauges + g) * STATS + s] = LANE(k->stat[g][s], l);
  k->leg[l]++;
}

static void close_lane(const Task *a, Pack *k, int l, int code) {
  double *out = a->status + 2 * k->at[l];
  out[0] = code; out[1] = LANE(k->t, l);
  SET(k->live, l, 0.0);
}

/* Gauges over the substep from y0 to y1 of length h that ends at time t1. */
INLINE void measure(const Task *a, Pack *k, const T *y0, const T *y1, T h) {
  T moved = LESS(C(0.0), h), half = h * C(0.5), t1 = k->t + h;
  for (int64_t g = 0; g < a->gauges; g++) {
    int c = (int)a->gauge[3 * g];
    T v0 = y0[c], v1 = y1[c], level = C(a->gauge[3 * g + 2]), *s = k->stat[g];
    if (a->gauge[3 * g + 1] != 0.0) { v0 = ABS(v0); v1 = ABS(v1); }
    T low = LESS(v1, s[0]) * moved, high = LESS(s[2], v1) * moved;
    s[0] = PICK(low, v1, s[0]); s[1] = PICK(low, t1, s[1]);
    s[2] = PICK(high, v1, s[2]); s[3] = PICK(high, t1, s[3]);
    s[4] += half * (v0 + v1);
    s[5] += half * (v0 * v0 + v1 * v1);
    T e0 = v0 - level, e1 = v1 - level, over = LESS(C(0.0), e0), under = LESS(C(0.0), e1);
    s[6] += half * (over + under);
    T crossed = ABS(over - under) * moved;
    if (any(crossed)) {
      T when = k->t + h * (e0 / (e0 - e1 + SAME(e0, e1)));
      s[7] = PICK(crossed * (C(1.0) - SAME(s[7], s[7])), when, s[7]);
      s[8] = PICK(crossed, when, s[8]);
    }
  }
}

/* Shorten h of the lanes whose event came within it, by regula falsi (Illinois) on whole integrations. */
static __attribute__((noinline)) T land(const Task *a, Pack *k, const T *x0, const T *y0, T *y1, T h, T c, T e0, T e1) {
  T low = C(0.0), high = h, at_low = e0, at_high = e1, last = C(0.0), tau = h;
  for (int n = 0; n < SEARCH; n++) {
    T span = at_high - at_low;
    tau = PICK(c, high - at_high * (high - low) / (span + SAME(span, C(0.0))), h);
    memcpy(k->x, x0, sizeof k->x);
    advance(k->p, k->x, k->asked, tau, a->steps);
    look(k, y0, y1);
    T e = event(k, y1), same = LEQ(C(0.0), e * at_high), was = SAME(last, C(2.0) * same - C(1.0));
    if (!any(c * LESS(C(1e-12), ABS(e)))) break;
    at_low = PICK(same * was, at_low * C(0.5), PICK(same, at_low, e));
    at_high = PICK((C(1.0) - same) * was, at_high * C(0.5), PICK(same, e, at_high));
    high = PICK(same, tau, high); low = PICK(same, low, tau);
    last = C(2.0) * same - C(1.0);
  }
  return tau;
}

/* Lanes that reached the end of a leg, by event (c) or by time: mark, next leg, new command. */
static __attribute__((noinline)) void turn_over(const Task *a, Pack *k, T c) {
  T changed = C(0.0);
  EACH(l) {
    if (LANE(k->live, l) == 0.0) continue;
    int by_event = LANE(c, l) != 0.0, by_time = LANE(k->t, l) >= LANE(k->end, l) - EPS;
    if (!by_event && !by_time) continue;
    const double *row = a->plan + k->at[l] * a->plan_stride + k->leg[l] * (HEAD + NO);
    finish(a, k, l, by_event ? BY_EVENT : BY_TIME);
    if (!by_event && row[4] != 0.0) { close_lane(a, k, l, LATE); continue; }
    begin(a, k, l);
    if (LANE(k->live, l) == 0.0) { close_lane(a, k, l, DONE); continue; }
    SET(changed, l, 1.0);
  }
  if (any(changed)) {
    T y[NY];
    look(k, k->y, y); /* distances along and across belong to the new leg's line */
    for (int i = 0; i < NY; i++) k->y[i] = PICK(changed, y[i], k->y[i]);
    order(a, k, changed);
    EACH(l) if (LANE(changed, l) != 0.0) { /* with the new line in the channels */
      SET(k->side, l, LANE(side_of(event(k, k->y)), l));
      fresh(a, k, l);
    }
  }
}

/* All lanes to time tg. */
INLINE void tick(const Task *a, Pack *k, double tg) {
  for (;;) {
    T h = MAX(MIN(C(tg), k->end) - k->t, C(0.0)) * k->live;
    T x0[NX], y0[NY], y1[NY];
    memcpy(x0, k->x, sizeof x0); memcpy(y0, k->y, sizeof y0); memcpy(y1, k->y, sizeof y1);
    advance(k->p, k->x, k->asked, h, a->steps);
    look(k, y0, y1);
    T c = C(0.0);
    if (any(k->channel + C(1.0))) {
      T e0 = event(k, y0), e1 = event(k, y1);
      T watched = LEQ(C(0.0), k->channel) * LESS(C(0.0), h);
      c = LESS(e1 * k->side, C(0.0)) * watched;
      if (any(c)) h = land(a, k, x0, y0, y1, h, c, e0, e1);
      /* a leg that began on its level gets its side from the first motion */
      k->side = PICK(SAME(k->side, C(0.0)) * watched, side_of(e1), k->side);
    }
    T sound = LESS(y1[SPEED], k->fastest) * SAME(y1[Z], y1[Z]) * SAME(y1[PSI], y1[PSI]);
    T lost = k->live * (C(1.0) - sound);
    if (any(lost)) {
      EACH(l) if (LANE(lost, l) != 0.0) {
        double v = LANE(y1[SPEED], l);
        int code = v >= LANE(k->fastest, l) && v < 1e300 ? TOO_FAST : NOT_FINITE;
        for (int i = 0; i < NX; i++) SET(k->x[i], l, LANE(x0[i], l));
        for (int i = 0; i < NY; i++) SET(y1[i], l, LANE(y0[i], l));
        SET(h, l, 0.0); SET(c, l, 0.0);
        close_lane(a, k, l, code);
      }
    }
    for (int i = 0; i < NM; i++) k->m[i] += h * k->rates[i];
    keep(k, y1);
    y1[NS + 3] = y0[NS + 3];
    if (a->gauges) measure(a, k, y0, y1, h);
    k->t += h;
    memcpy(k->y, y1, sizeof y1);
    if (any(k->live * MAX(c, LEQ(k->end - C(EPS), k->t)))) turn_over(a, k, c);
    if (!any(k->live * LESS(k->t, C(tg - EPS)))) break;
  }
}

/* Sample n of the lanes that are at its time. */
static void record(const Task *a, const Pack *k, int64_t n, int64_t first) {
  int64_t sample = n / a->every;
  if (!a->log || n % a->every || sample >= a->samples) return;
  EACH(l) {
    if (first + l >= a->to || LANE(k->t, l) < a->tick * (double)n - EPS) continue;
    double *out = a->log + (k->at[l] * a->samples + sample) * a->channels;
    for (int64_t c = 0; c < a->channels; c++) out[c] = LANE(k->y[a->channel[c]], l);
  }
}

static void load(const Task *a, Pack *k, int64_t first) {
  T none[NY];
  memset(k, 0, sizeof *k);
  memset(none, 0, sizeof none);
  for (int i = 0; i < NP; i++) k->p[i] = C(a->common[i]);
  EACH(l) {
    k->at[l] = first + l < a->to ? first + l : a->to - 1;
    for (int64_t j = 0; j < a->varying; j++) SET(k->p[a->which[j]], l, a->varied[k->at[l] * a->varying + j]);
    const double *s = a->start + k->at[l] * a->start_stride;
    for (int i = 0; i < NX; i++) SET(k->x[i], l, s[i]);
    for (int i = 0; i < NM; i++) SET(k->m[i], l, s[NX + i]);
    SET(k->live, l, 1.0);
    SET(k->fastest, l, a->fastest[k->at[l]]);
  }
  for (int i = 0; i < NF; i++) none[DELTA + i] = k->asked[i] = k->answered[i] = k->x[NX - NF + i];
  EACH(l) begin(a, k, l); /* the orders, which the channels need */
  look(k, none, k->y);
  sense(a, k, 0);
  order(a, k, C(1.0));
  EACH(l) begin(a, k, l);
}

/* Trajectories a->from to a->to; returns how many packs' trajectories were gone through, all unless stopped. */
__attribute__((visibility("default"))) int64_t NAME(run)(const Task *a) {
  Pack k;
  for (int64_t first = a->from; first < a->to; first += LANES) {
    load(a, &k, first);
    int64_t n = 0;
    while (any(k.live)) {
      if (a->stop && *a->stop) {
        EACH(l) if (LANE(k.live, l) != 0.0) close_lane(a, &k, l, STOPPED);
        break;
      }
      record(a, &k, n, first);
      n++;
      tick(a, &k, a->tick * (double)n);
      if (any(k.live)) { sense(a, &k, n); order(a, &k, k.live); }
    }
    int stopped = a->stop && *a->stop;
    if (!stopped) record(a, &k, n, first);
    EACH(l) if (first + l < a->to && a->status[2 * k.at[l]] != STOPPED) {
      double *e = a->end + k.at[l] * (NX + NM);
      for (int i = 0; i < NX; i++) e[i] = LANE(k.x[i], l);
      for (int i = 0; i < NM; i++) e[NX + i] = LANE(k.m[i], l);
    }
    if (stopped) return first - a->from;
  }
  return a->to - a->from;
}
