/* FMI 2.0 for Co-Simulation, see https://fmi-standard.org; what models without integers, booleans and texts need. */

#include "fmu.h"

#include <stdlib.h>
#include <string.h>

typedef int fmi2Boolean, fmi2Integer, fmi2Status;
typedef unsigned fmi2ValueReference;
typedef double fmi2Real;
typedef const char *fmi2String;
typedef void *fmi2Component;
typedef void (*fmi2Logger)(void *environment, fmi2String name, fmi2Status status, fmi2String category,
                           fmi2String message, ...);
typedef struct {
    fmi2Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*finished)(void *, fmi2Status);
    void *environment;
} fmi2Callbacks;

enum { CO_SIMULATION = 1 };

/* The logger is a pointer to a function; one to data may be of another size. */
static void tell(const fmu *self, int status, const char *message) {
    fmi2Logger logger;
    memcpy(&logger, &self->logger, sizeof logger);
    logger(self->environment, self->name, status, "logStatusError", "%s", message);
}

GEARMBS_API fmi2String fmi2GetTypesPlatform(void) { return "default"; }
GEARMBS_API fmi2String fmi2GetVersion(void) { return "2.0"; }

GEARMBS_API fmi2Component fmi2Instantiate(fmi2String name, int kind, fmi2String guid, fmi2String resources,
                                          const fmi2Callbacks *functions, fmi2Boolean visible, fmi2Boolean logging) {
    void *logger = NULL;
    (void)resources, (void)visible, (void)logging;
    if (functions != NULL && functions->logger != NULL) memcpy(&logger, &functions->logger, sizeof logger);
    if (kind != CO_SIMULATION || name == NULL || guid == NULL) return NULL;
    return fmu_new(name, guid, functions == NULL ? NULL : functions->environment, logger, tell);
}

GEARMBS_API void fmi2FreeInstance(fmi2Component c) { fmu_free(c); }

GEARMBS_API fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)c, (void)on, (void)n, (void)categories;
    return FMU_OK;
}

GEARMBS_API fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                           fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance, (void)tolerance; /* the model has its own */
    return fmu_span(c, start, has_stop, stop);
}

GEARMBS_API fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (void)c, FMU_OK; }
GEARMBS_API fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (void)c, FMU_OK; }
GEARMBS_API fmi2Status fmi2Terminate(fmi2Component c) { return (void)c, FMU_OK; }
GEARMBS_API fmi2Status fmi2Reset(fmi2Component c) { return fmu_reset(c); }

GEARMBS_API fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real values[]) {
    return fmu_get(c, r, n, values);
}

GEARMBS_API fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real values[]) {
    return fmu_set(c, r, n, values);
}

#define NO_VARIABLES(kind, type)                                                                                       \
    GEARMBS_API fmi2Status fmi2Get##kind(fmi2Component c, const fmi2ValueReference r[], size_t n, type values[]) {     \
        return (void)r, (void)values, n == 0 ? FMU_OK : fmu_refuse(c, "All variables are real numbers.");              \
    }                                                                                                                  \
    GEARMBS_API fmi2Status fmi2Set##kind(fmi2Component c, const fmi2ValueReference r[], size_t n,                      \
                                         const type values[]) {                                                        \
        return (void)r, (void)values, n == 0 ? FMU_OK : fmu_refuse(c, "All variables are real numbers.");              \
    }

NO_VARIABLES(Integer, fmi2Integer)
NO_VARIABLES(Boolean, fmi2Boolean)
NO_VARIABLES(String, fmi2String)

GEARMBS_API fmi2Status fmi2GetFMUstate(fmi2Component c, void **state) { return fmu_save(c, state); }

GEARMBS_API fmi2Status fmi2SetFMUstate(fmi2Component c, void *state) {
    return fmu_restore(c, state, gearmbs_state_size());
}

GEARMBS_API fmi2Status fmi2FreeFMUstate(fmi2Component c, void **state) {
    (void)c;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return FMU_OK;
}

GEARMBS_API fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, void *state, size_t *size) {
    (void)c, (void)state;
    *size = gearmbs_state_size();
    return FMU_OK;
}

GEARMBS_API fmi2Status fmi2SerializeFMUstate(fmi2Component c, void *state, char bytes[], size_t size) {
    if (size < gearmbs_state_size()) return fmu_refuse(c, "The room is smaller than a serialised state.");
    memcpy(bytes, state, gearmbs_state_size());
    return FMU_OK;
}

GEARMBS_API fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const char bytes[], size_t size, void **state) {
    if (size != gearmbs_state_size()) return fmu_refuse(c, "This is no serialised state of the model.");
    if (*state == NULL) *state = malloc(size);
    if (*state == NULL) return fmu_refuse(c, "Memory is short.");
    memcpy(*state, bytes, size);
    return FMU_OK;
}

GEARMBS_API fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t rows,
                                                    const fmi2ValueReference known[], size_t columns,
                                                    const fmi2Real along[], fmi2Real values[]) {
    return fmu_derivative(c, unknowns, rows, known, columns, along, values);
}

GEARMBS_API fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                                   const fmi2Integer order[], const fmi2Real values[]) {
    return (void)r, (void)n, (void)order, (void)values, fmu_refuse(c, "Inputs are held between communication points.");
}

GEARMBS_API fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                                    const fmi2Integer order[], fmi2Real values[]) {
    return (void)r, (void)n, (void)order, (void)values, fmu_refuse(c, "Derivatives of outputs are not provided.");
}

GEARMBS_API fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_rollback) {
    (void)no_rollback;
    return fmu_step(c, time, size);
}

/* Steps are over when doStep returns. */
GEARMBS_API fmi2Status fmi2CancelStep(fmi2Component c) { return fmu_refuse(c, "No step is under way."); }
GEARMBS_API fmi2Status fmi2GetStatus(fmi2Component c, int kind, fmi2Status *value) {
    return (void)kind, (void)value, fmu_refuse(c, "No step is under way.");
}
GEARMBS_API fmi2Status fmi2GetRealStatus(fmi2Component c, int kind, fmi2Real *value) {
    enum { LAST_TIME = 2 };
    if (kind != LAST_TIME) return fmu_refuse(c, "No step is under way.");
    *value = gearmbs_time(((fmu *)c)->instance);
    return FMU_OK;
}
GEARMBS_API fmi2Status fmi2GetIntegerStatus(fmi2Component c, int kind, fmi2Integer *value) {
    return (void)kind, (void)value, fmu_refuse(c, "No step is under way.");
}
GEARMBS_API fmi2Status fmi2GetBooleanStatus(fmi2Component c, int kind, fmi2Boolean *value) {
    return (void)kind, (void)value, fmu_refuse(c, "No step is under way.");
}
GEARMBS_API fmi2Status fmi2GetStringStatus(fmi2Component c, int kind, fmi2String *value) {
    return (void)kind, (void)value, fmu_refuse(c, "No step is under way.");
}
