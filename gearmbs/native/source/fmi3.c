/* FMI 3.0 for Co-Simulation, see https://fmi-standard.org; what models of 64-bit floating-point numbers need. */

#include "fmu.h"
#include "model.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef int fmi3Status;
typedef unsigned fmi3ValueReference;
typedef void *fmi3Instance;
typedef const char *fmi3String;
typedef void (*fmi3Logger)(void *environment, fmi3Status status, fmi3String category, fmi3String message);
typedef void (*fmi3Update)(void *environment, double time, bool may_set, bool may_get, bool step_ends, bool may_return,
                           bool *returns, double *at);

static void tell(const fmu *self, int status, const char *message) {
    fmi3Logger logger;
    memcpy(&logger, &self->logger, sizeof logger);
    logger(self->environment, status, "logStatusError", message);
}

GEARMBS_API fmi3String fmi3GetVersion(void) { return "3.0"; }

GEARMBS_API fmi3Status fmi3SetDebugLogging(fmi3Instance c, bool on, size_t n, const fmi3String categories[]) {
    return (void)c, (void)on, (void)n, (void)categories, FMU_OK;
}

GEARMBS_API fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, bool visible, bool logging, bool events, bool early,
    const fmi3ValueReference intermediate[], size_t n, void *environment, fmi3Logger logger, fmi3Update update) {
    void *kept = NULL;
    (void)resources, (void)visible, (void)logging, (void)events, (void)intermediate, (void)n;
    if (logger != NULL) memcpy(&kept, &logger, sizeof logger);
    if (name == NULL || token == NULL) return NULL;
    fmu *made = fmu_new(name, token, environment, kept, tell);
    if (made != NULL && update != NULL) {
        memcpy(&made->update, &update, sizeof update);
        made->returns_early = early;
    }
    return made;
}

GEARMBS_API fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, bool visible,
                                                      bool logging, void *environment, fmi3Logger logger) {
    return (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)logger,
           (fmi3Instance)NULL;
}

GEARMBS_API fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                           bool visible, bool logging, void *environment,
                                                           fmi3Logger logger, void *clock, void *lock, void *unlock) {
    return (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)logger,
           (void)clock, (void)lock, (void)unlock, (fmi3Instance)NULL;
}

GEARMBS_API void fmi3FreeInstance(fmi3Instance c) { fmu_free(c); }

GEARMBS_API fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool has_tolerance, double tolerance, double start,
                                                   bool has_stop, double stop) {
    (void)has_tolerance, (void)tolerance; /* the model has its own */
    return fmu_span(c, start, has_stop, stop);
}

GEARMBS_API fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return (void)c, FMU_OK; }
GEARMBS_API fmi3Status fmi3EnterStepMode(fmi3Instance c) { return (void)c, FMU_OK; }
GEARMBS_API fmi3Status fmi3EnterEventMode(fmi3Instance c) { return (void)c, FMU_OK; }
GEARMBS_API fmi3Status fmi3Terminate(fmi3Instance c) { return (void)c, FMU_OK; }
GEARMBS_API fmi3Status fmi3Reset(fmi3Instance c) { return fmu_reset(c); }

/* Return the references of all numbers of some variables, NULL if they are not as many as there are values; to be freed. */
static unsigned *references_of(const fmu *self, const fmi3ValueReference r[], size_t n, size_t count) {
    size_t known = gearmbs_numbers() + gearmbs_outputs(), sum = 0;
    unsigned *all = malloc((count + 1) * sizeof *all);
    for (size_t k = 0; k < n && all != NULL; k++) {
        /* the time stands behind all others */
        size_t width = r[k] < known ? (size_t)gearmbs_this.widths[r[k]] : 1;
        for (size_t e = 0; e < width && sum + e < count; e++) all[sum + e] = r[k] + (unsigned)e;
        sum += width;
    }
    if (all != NULL && sum == count) return all;
    fmu_refuse(self, "There are not as many values as the variables have.");
    free(all);
    return NULL;
}

GEARMBS_API fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, double values[],
                                      size_t count) {
    unsigned *all = references_of(c, r, n, count);
    int status = all == NULL ? FMU_ERROR : fmu_get(c, all, count, values);
    free(all);
    return status;
}

GEARMBS_API fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const double values[],
                                      size_t count) {
    unsigned *all = references_of(c, r, n, count);
    int status = all == NULL ? FMU_ERROR : fmu_set(c, all, count, values);
    free(all);
    return status;
}

static fmi3Status none(fmi3Instance c, size_t n) {
    return n == 0 ? FMU_OK : fmu_refuse(c, "All variables are 64-bit floating-point numbers.");
}

#define NO_VARIABLES(kind, type)                                                                                       \
    GEARMBS_API fmi3Status fmi3Get##kind(fmi3Instance c, const fmi3ValueReference r[], size_t n, type values[],        \
                                         size_t count) {                                                               \
        return (void)r, (void)values, (void)count, none(c, n);                                                         \
    }                                                                                                                  \
    GEARMBS_API fmi3Status fmi3Set##kind(fmi3Instance c, const fmi3ValueReference r[], size_t n, const type values[],  \
                                         size_t count) {                                                               \
        return (void)r, (void)values, (void)count, none(c, n);                                                         \
    }

NO_VARIABLES(Float32, float)
NO_VARIABLES(Int8, int8_t)
NO_VARIABLES(UInt8, uint8_t)
NO_VARIABLES(Int16, int16_t)
NO_VARIABLES(UInt16, uint16_t)
NO_VARIABLES(Int32, int32_t)
NO_VARIABLES(UInt32, uint32_t)
NO_VARIABLES(Int64, int64_t)
NO_VARIABLES(UInt64, uint64_t)
NO_VARIABLES(Boolean, bool)
NO_VARIABLES(String, fmi3String)

GEARMBS_API fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, size_t sizes[],
                                     const uint8_t *values[], size_t count) {
    return (void)r, (void)sizes, (void)values, (void)count, none(c, n);
}
GEARMBS_API fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, const size_t sizes[],
                                     const uint8_t *const values[], size_t count) {
    return (void)r, (void)sizes, (void)values, (void)count, none(c, n);
}
GEARMBS_API fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, bool values[]) {
    return (void)r, (void)values, none(c, n);
}
GEARMBS_API fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, const bool values[]) {
    return (void)r, (void)values, none(c, n);
}

GEARMBS_API fmi3Status fmi3GetFMUState(fmi3Instance c, void **state) { return fmu_save(c, state); }

GEARMBS_API fmi3Status fmi3SetFMUState(fmi3Instance c, void *state) {
    return fmu_restore(c, state, gearmbs_state_size());
}

GEARMBS_API fmi3Status fmi3FreeFMUState(fmi3Instance c, void **state) {
    (void)c;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return FMU_OK;
}

GEARMBS_API fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, void *state, size_t *size) {
    (void)c, (void)state;
    *size = gearmbs_state_size();
    return FMU_OK;
}

GEARMBS_API fmi3Status fmi3SerializeFMUState(fmi3Instance c, void *state, uint8_t bytes[], size_t size) {
    if (size < gearmbs_state_size()) return fmu_refuse(c, "The room is smaller than a serialised state.");
    memcpy(bytes, state, gearmbs_state_size());
    return FMU_OK;
}

GEARMBS_API fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const uint8_t bytes[], size_t size, void **state) {
    if (size != gearmbs_state_size()) return fmu_refuse(c, "This is no serialised state of the model.");
    if (*state == NULL) *state = malloc(size);
    if (*state == NULL) return fmu_refuse(c, "Memory is short.");
    memcpy(*state, bytes, size);
    return FMU_OK;
}

/* Go on by a step, and tell the importer of each step of the integrator on the way; it may ask to return before the end. */
static fmi3Status step_with_updates(fmu *self, double time, double size, bool *early) {
    double end, now = gearmbs_time(self->instance);
    int status = fmu_end(self, time, size, &end);
    fmi3Update update;
    memcpy(&update, &self->update, sizeof update);
    while (status == FMU_OK && now < end) {
        double next = fmu_next(self), wanted = end;
        bool returns = false;
        status = fmu_go(self, next < end ? next : end);
        if (status != FMU_OK) break;
        now = gearmbs_time(self->instance);
        bool step_ends = now == gearmbs_integrated(self->instance);
        if (!step_ends && now < end) continue;
        update(self->environment, now, false, true, step_ends, self->returns_early && now < end, &returns, &wanted);
        if (returns && self->returns_early && wanted < end) {
            end = wanted > now ? wanted : now;
            *early = true;
        }
    }
    return status;
}

GEARMBS_API fmi3Status fmi3DoStep(fmi3Instance c, double time, double size, bool no_rollback, bool *event, bool *ends,
                                  bool *early, double *last) {
    fmu *self = c;
    (void)no_rollback;
    *event = *ends = *early = false;
    int status = self->update == NULL ? fmu_step(self, time, size) : step_with_updates(self, time, size, early);
    *last = gearmbs_time(self->instance);
    return status;
}

/* Inputs may jump in event mode, as at any communication point; the model has no discrete states and no events of its
   own. */
GEARMBS_API fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, bool *again, bool *ends, bool *nominals, bool *states,
                                                bool *defined, double *next) {
    (void)c;
    *again = *ends = *nominals = *states = *defined = false;
    *next = 0.0;
    return FMU_OK;
}

GEARMBS_API fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t rows,
                                                    const fmi3ValueReference known[], size_t columns,
                                                    const double along[], size_t size, double values[], size_t count) {
    unsigned *outputs = references_of(c, unknowns, rows, count), *inputs = references_of(c, known, columns, size);
    int status = outputs == NULL || inputs == NULL
                     ? FMU_ERROR
                     : fmu_derivative(c, outputs, count, inputs, size, along, values);
    free(outputs);
    free(inputs);
    return status;
}

/* What this model has none of: arrays that change, clocks, derivatives by time and backwards. */
#define NONE(name, ...)                                                                                                \
    GEARMBS_API fmi3Status fmi3##name(fmi3Instance c, __VA_ARGS__) { return fmu_refuse(c, #name " is not provided."); }
#define NONE_OF_INSTANCE(name)                                                                                         \
    GEARMBS_API fmi3Status fmi3##name(fmi3Instance c) { return fmu_refuse(c, #name " is not provided."); }

#pragma GCC diagnostic ignored "-Wunused-parameter"
typedef const fmi3ValueReference *references;
NONE_OF_INSTANCE(EnterConfigurationMode)
NONE_OF_INSTANCE(ExitConfigurationMode)
NONE_OF_INSTANCE(EnterContinuousTimeMode)
NONE_OF_INSTANCE(EvaluateDiscreteStates)
NONE(GetNumberOfVariableDependencies, fmi3ValueReference r, size_t *count)
NONE(GetVariableDependencies, fmi3ValueReference r, size_t places[], references others, size_t other_places[],
     int kinds[], size_t count)
NONE(GetAdjointDerivative, references unknowns, size_t rows, references known, size_t columns, const double along[],
     size_t size, double values[], size_t count)
NONE(GetOutputDerivatives, references r, size_t n, const int32_t orders[], double values[], size_t count)
NONE(GetIntervalDecimal, references r, size_t n, double intervals[], int kinds[])
NONE(GetIntervalFraction, references r, size_t n, uint64_t counters[], uint64_t resolutions[], int kinds[])
NONE(GetShiftDecimal, references r, size_t n, double shifts[])
NONE(GetShiftFraction, references r, size_t n, uint64_t counters[], uint64_t resolutions[])
NONE(SetIntervalDecimal, references r, size_t n, const double intervals[])
NONE(SetIntervalFraction, references r, size_t n, const uint64_t counters[], const uint64_t resolutions[])
NONE(SetShiftDecimal, references r, size_t n, const double shifts[])
NONE(SetShiftFraction, references r, size_t n, const uint64_t counters[], const uint64_t resolutions[])
NONE(CompletedIntegratorStep, bool no_rollback, bool *event, bool *ends)
NONE(SetTime, double time)
NONE(SetContinuousStates, const double states[], size_t count)
NONE(GetContinuousStateDerivatives, double values[], size_t count)
NONE(GetEventIndicators, double values[], size_t count)
NONE(GetContinuousStates, double states[], size_t count)
NONE(GetNominalsOfContinuousStates, double values[], size_t count)
NONE(GetNumberOfEventIndicators, size_t *count)
NONE(GetNumberOfContinuousStates, size_t *count)
NONE(ActivateModelPartition, fmi3ValueReference clock, double time)
