/* What Python hands over (towtank.engine.library.Task has the same fields in the same order). */
#ifndef TASK_H
#define TASK_H
#include <stdint.h>

enum { LEG_HEAD = 5 };  /* of a leg: longest duration, event channel (-1: none), absolute?, level, required? ; then its orders */
enum { STATS = 9 };     /* of a gauge: min, its time, max, its time, integral, integral of the square, time above the level,
                           first and last crossing of the level */
enum { BY_EVENT = 1, BY_TIME = 2 };                         /* what ended a leg */
enum { DONE = 0, NOT_FINITE = 1, TOO_FAST = 2, LATE = 3, STOPPED = 4 };  /* what ended a trajectory */

typedef struct {
  int64_t from, to;            /* trajectories of this call */
  const double *common;        /* (NP) parameters of all trajectories */
  int64_t varying;             /* number of parameters that differ between trajectories */
  const int64_t *which;        /* (varying) their places */
  const double *varied;        /* (count, varying) their values */
  const double *start;         /* (count or 1, NX + NM) state and memory of the steering */
  int64_t start_stride;        /* NX + NM, or 0 when shared */
  int64_t legs;
  const double *plan;          /* (count or 1, legs, LEG_HEAD + NO) */
  int64_t plan_stride;         /* legs * (LEG_HEAD + NO), or 0 when shared */
  double tick;                 /* control period [s] */
  int64_t steps;               /* RK4 steps in it */
  const double *fastest;       /* (count) speed [m/s] beyond which a trajectory is stopped */
  int64_t gauges;
  const double *gauge;         /* (gauges, 3) channel, absolute?, level */
  int64_t channels;
  const int64_t *channel;      /* (channels) what is logged */
  int64_t every, samples;      /* ticks between samples; samples per trajectory */
  double *log;                 /* (count, samples, channels) or null */
  double *stats;               /* (count, legs, gauges, STATS) or null */
  double *marks;               /* (count, legs, 2 + NY) time, what ended it, channels; or null */
  double *end;                 /* (count, NX + NM) */
  double *status;              /* (count, 2) code, time */
  const double *sensors;       /* (NSEEN, 3) of what the pilot sees: ticks between readings, std, std of the offset; or null */
  int64_t seed;                /* of their noise */
  const volatile int32_t *stop;
} Task;
#endif
