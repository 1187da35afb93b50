/* A simulation of gearmbs as a library: instances of one model that go from one time to the next.

   No function keeps anything outside an instance. Instances may be used in different threads at the same time, one
   instance by one thread at a time. All quantities are in SI units.

   Functions that return a code return GEARMBS_OK, GEARMBS_REFUSED where an argument is of no use and nothing has been
   done, or a failure of the integration, after which an instance can only be restored to an earlier state or freed. */

#ifndef GEARMBS_H
#define GEARMBS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32)
#define GEARMBS_API __declspec(dllexport)
#else
#define GEARMBS_API __attribute__((visibility("default")))
#endif

enum {
    GEARMBS_OK = 0,
    GEARMBS_SINGULAR = -2,
    GEARMBS_NOT_FINITE = -3,
    GEARMBS_STEP_TOO_SMALL = -4,
    GEARMBS_TOO_MANY_REJECTIONS = -5,
    GEARMBS_INCONSISTENT_START = -6,
    GEARMBS_TOO_MANY_STEPS = -7,
    GEARMBS_NEWTON_FAILURE = -9,
    GEARMBS_STALLED = -12,
    GEARMBS_BELOW_ROUNDING = -13,
    GEARMBS_REFUSED = -20,
    GEARMBS_NO_ROOM = -21,
    GEARMBS_KERNEL_FAILED = -22,
    GEARMBS_OUT_OF_RANGE = -23
};

typedef struct gearmbs_instance gearmbs_instance;

/* A sentence that says what a code means. */
GEARMBS_API const char *gearmbs_message(int code);

/* The model: its name, start and end of the span in which it can be simulated, numbers that can be set, outputs. */
GEARMBS_API const char *gearmbs_model_name(void);
GEARMBS_API double gearmbs_start_time(void);
GEARMBS_API double gearmbs_end_time(void);
GEARMBS_API size_t gearmbs_numbers(void);
GEARMBS_API const char *gearmbs_number_name(size_t number);
GEARMBS_API const char *gearmbs_number_unit(size_t number);

/* Write the least and the largest value that a number can be set to, infinite where there is no bound. */
GEARMBS_API int gearmbs_number_range(size_t number, double *least, double *most);

GEARMBS_API size_t gearmbs_outputs(void);
GEARMBS_API const char *gearmbs_output_name(size_t output);
GEARMBS_API const char *gearmbs_output_unit(size_t output);
GEARMBS_API size_t gearmbs_unknowns(void);
GEARMBS_API const char *gearmbs_unknown_name(size_t unknown);

/* Return a new instance at the start, NULL where memory is short; free it, or NULL. */
GEARMBS_API gearmbs_instance *gearmbs_create(void);
GEARMBS_API void gearmbs_free(gearmbs_instance *instance);

/* The present time, s, the end of the last step of the integrator, which may lie behind it, and the steps taken so far. */
GEARMBS_API double gearmbs_time(const gearmbs_instance *instance);
GEARMBS_API double gearmbs_integrated(const gearmbs_instance *instance);
GEARMBS_API long long gearmbs_steps(const gearmbs_instance *instance);

/* Let a number take another value from the present time on; it takes effect with the next advance or save. */
GEARMBS_API int gearmbs_set(gearmbs_instance *instance, size_t number, double value);

/* Write the present value of a number, the one that was set last. */
GEARMBS_API int gearmbs_number(gearmbs_instance *instance, size_t number, double *value);

/* Let what has been set take effect now: outputs at the present time are then those with it. */
GEARMBS_API int gearmbs_take_effect(gearmbs_instance *instance);

/* Go on to a time, s, from the present one up to the end. */
GEARMBS_API int gearmbs_advance(gearmbs_instance *instance, double time);

/* Write all outputs at the present time, as they are before what has been set there has taken effect. */
GEARMBS_API int gearmbs_get(gearmbs_instance *instance, double *outputs);

/* Write the unknowns of the equations and their rates at the present time; either may be NULL. */
GEARMBS_API int gearmbs_get_unknowns(const gearmbs_instance *instance, double *values, double *rates);

/* The state of an instance with the history of its integration: what follows from it is the same, bit for bit, in
   this instance or another one of the same library, also in another process. */
GEARMBS_API size_t gearmbs_state_size(void);
GEARMBS_API int gearmbs_save(gearmbs_instance *instance, void *state);
GEARMBS_API int gearmbs_restore(gearmbs_instance *instance, const void *state, size_t size);

#ifdef __cplusplus
}
#endif
#endif
