/* Calls everything of a library, or of an FMU's, for sanitizers: an instance that is saved, restored in another one,
   refused and freed. WALK says by which interface. Returns 0 if what should be equal is. */

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(what)                                                                                                    \
    do {                                                                                                               \
        if (!(what)) {                                                                                                 \
            fprintf(stderr, "line %d: %s\n", __LINE__, #what);                                                         \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

enum { POINTS = 20 };

#if WALK == 0
#include "gearmbs.h"

int main(void) {
    size_t outputs = gearmbs_outputs(), unknowns = gearmbs_unknowns(), size = gearmbs_state_size();
    double end = gearmbs_end_time(), value;
    double *one = malloc(8 * outputs), *two = malloc(8 * outputs), *y = malloc(8 * unknowns), *yp = malloc(8 * unknowns);
    void *state = malloc(size);
    gearmbs_instance *first = gearmbs_create(), *second = gearmbs_create();
    CHECK(first != NULL && second != NULL && gearmbs_start_time() == 0.0 && strlen(gearmbs_model_name()) > 0);
    for (size_t k = 0; k < gearmbs_numbers(); k++) {
        CHECK(gearmbs_number_name(k) != NULL && gearmbs_number_unit(k) != NULL);
        CHECK(gearmbs_number(first, k, &value) == GEARMBS_OK);
    }
    for (size_t k = 0; k < outputs; k++) CHECK(gearmbs_output_name(k) != NULL && gearmbs_output_unit(k) != NULL);
    for (size_t k = 0; k < unknowns; k++) CHECK(gearmbs_unknown_name(k) != NULL);
    CHECK(gearmbs_output_name(outputs) == NULL && gearmbs_set(first, gearmbs_numbers(), 1.0) == GEARMBS_REFUSED);
    for (int k = 1; k <= POINTS; k++) {
        CHECK(gearmbs_set(first, 0, k % 3 + 1.0) == GEARMBS_OK);
        if (k == 5) CHECK(gearmbs_take_effect(first) == GEARMBS_OK && gearmbs_get(first, one) == GEARMBS_OK);
        CHECK(gearmbs_advance(first, end * k / POINTS) == GEARMBS_OK);
        CHECK(gearmbs_get(first, one) == GEARMBS_OK && gearmbs_get_unknowns(first, y, yp) == GEARMBS_OK);
        if (k == POINTS / 2) CHECK(gearmbs_save(first, state) == GEARMBS_OK);
    }
    CHECK(gearmbs_advance(first, 0.5 * end) == GEARMBS_REFUSED && gearmbs_restore(first, state, size - 1) == GEARMBS_REFUSED);
    CHECK(gearmbs_restore(second, state, size) == GEARMBS_OK);
    for (int k = POINTS / 2 + 1; k <= POINTS; k++) {
        CHECK(gearmbs_set(second, 0, k % 3 + 1.0) == GEARMBS_OK);
        CHECK(gearmbs_advance(second, end * k / POINTS) == GEARMBS_OK && gearmbs_get(second, two) == GEARMBS_OK);
    }
    CHECK(memcmp(one, two, 8 * outputs) == 0 && gearmbs_steps(first) == gearmbs_steps(second));
    CHECK(gearmbs_integrated(first) >= gearmbs_time(first));
    for (int code = -30; code < 2; code++) CHECK(gearmbs_message(code) != NULL);
    gearmbs_free(first);
    gearmbs_free(second);
    gearmbs_free(NULL);
    free(one), free(two), free(y), free(yp), free(state);
    return 0;
}
#elif WALK == 2
typedef void *component;
typedef void (*logged)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    logged log;
    void *allocate, *release, *finished, *environment;
} callbacks;
component fmi2Instantiate(const char *, int, const char *, const char *, const callbacks *, int, int);
int fmi2SetupExperiment(component, int, double, double, int, double), fmi2EnterInitializationMode(component);
int fmi2ExitInitializationMode(component), fmi2Terminate(component), fmi2Reset(component);
int fmi2GetReal(component, const unsigned *, size_t, double *), fmi2DoStep(component, double, double, int);
int fmi2SetReal(component, const unsigned *, size_t, const double *), fmi2GetFMUstate(component, void **);
int fmi2SetFMUstate(component, void *), fmi2FreeFMUstate(component, void **);
int fmi2SerializedFMUstateSize(component, void *, size_t *), fmi2SerializeFMUstate(component, void *, char *, size_t);
int fmi2DeSerializeFMUstate(component, const char *, size_t, void **);
int fmi2GetDirectionalDerivative(component, const unsigned *, size_t, const unsigned *, size_t, const double *, double *);
void fmi2FreeInstance(component);

static int told;
static void log_it(void *environment, const char *name, int status, const char *category, const char *message, ...) {
    (void)environment, (void)name, (void)status, (void)category, (void)message;
    told++;
}

int main(void) {
    callbacks own = {log_it, NULL, NULL, NULL, NULL};
    const unsigned number = 0, output = NUMBERS, none = 9999;
    double value = 3.0, one, two, slope, along = 1.0;
    void *state = NULL, *copy = NULL;
    size_t size;
    CHECK(fmi2Instantiate("a", 1, "another", NULL, &own, 0, 0) == NULL);
    component first = fmi2Instantiate("a", 1, TOKEN, NULL, &own, 0, 0);
    component second = fmi2Instantiate("b", 1, TOKEN, NULL, &own, 0, 0);
    CHECK(first != NULL && second != NULL);
    CHECK(fmi2SetupExperiment(first, 0, 0.0, 0.0, 1, END) == 0 && fmi2EnterInitializationMode(first) == 0);
    CHECK(fmi2ExitInitializationMode(first) == 0 && fmi2EnterInitializationMode(second) == 0);
    for (int k = 0; k < POINTS; k++) {
        CHECK(fmi2SetReal(first, &number, 1, &value) == 0 && fmi2DoStep(first, END * k / POINTS, END / POINTS, 0) == 0);
        CHECK(fmi2GetReal(first, &output, 1, &one) == 0);
        CHECK(fmi2GetDirectionalDerivative(first, &output, 1, &number, 1, &along, &slope) == 0);
        if (k == POINTS / 2 - 1) CHECK(fmi2GetFMUstate(first, &state) == 0);
    }
    CHECK(fmi2GetReal(first, &none, 1, &two) != 0 && fmi2SetReal(first, &none, 1, &value) != 0 && told > 0);
    CHECK(fmi2SerializedFMUstateSize(first, state, &size) == 0);
    char *bytes = malloc(size);
    CHECK(fmi2SerializeFMUstate(first, state, bytes, size) == 0 && fmi2DeSerializeFMUstate(second, bytes, size, &copy) == 0);
    CHECK(fmi2SetFMUstate(second, copy) == 0);
    for (int k = POINTS / 2; k < POINTS; k++) CHECK(fmi2DoStep(second, END * k / POINTS, END / POINTS, 0) == 0);
    CHECK(fmi2GetReal(second, &output, 1, &two) == 0 && one == two);
    CHECK(fmi2FreeFMUstate(first, &state) == 0 && fmi2FreeFMUstate(second, &copy) == 0 && state == NULL);
    CHECK(fmi2Reset(second) == 0 && fmi2Terminate(first) == 0);
    fmi2FreeInstance(first), fmi2FreeInstance(second);
    free(bytes);
    return 0;
}
#else
typedef void *instance;
typedef void (*updated)(void *, double, bool, bool, bool, bool, bool *, double *);
instance fmi3InstantiateCoSimulation(const char *, const char *, const char *, bool, bool, bool, bool, const unsigned *,
                                     size_t, void *, void *, updated);
int fmi3EnterInitializationMode(instance, bool, double, double, bool, double), fmi3ExitInitializationMode(instance);
int fmi3GetFloat64(instance, const unsigned *, size_t, double *, size_t), fmi3Terminate(instance);
int fmi3SetFloat64(instance, const unsigned *, size_t, const double *, size_t), fmi3Reset(instance);
int fmi3DoStep(instance, double, double, bool, bool *, bool *, bool *, double *), fmi3EnterEventMode(instance);
int fmi3GetFMUState(instance, void **), fmi3SetFMUState(instance, void *), fmi3FreeFMUState(instance, void **);
int fmi3GetDirectionalDerivative(instance, const unsigned *, size_t, const unsigned *, size_t, const double *, size_t,
                                 double *, size_t);
void fmi3FreeInstance(instance);

static int updates;
static void update(void *environment, double time, bool may_set, bool may_get, bool ends, bool may_return, bool *returns,
                   double *at) {
    (void)environment, (void)may_set, (void)may_get, (void)ends, (void)may_return;
    updates++;
    *returns = false;
    *at = time;
}

int main(void) {
    const unsigned number = 0, output = NUMBERS, none = 9999;
    double value = 3.0, one, two, slope, along = 1.0, last;
    bool event, ends, early;
    void *state = NULL;
    CHECK(fmi3InstantiateCoSimulation("a", "another", NULL, 0, 0, 1, 1, NULL, 0, NULL, NULL, update) == NULL);
    instance first = fmi3InstantiateCoSimulation("a", TOKEN, NULL, 0, 0, 1, 1, NULL, 0, NULL, NULL, update);
    CHECK(first != NULL && fmi3EnterInitializationMode(first, 0, 0.0, 0.0, 1, END) == 0);
    CHECK(fmi3ExitInitializationMode(first) == 0 && fmi3SetFloat64(first, &number, 1, &value, 1) == 0);
    CHECK(fmi3GetFMUState(first, &state) == 0);
    for (int round = 0; round < 2; round++) {
        for (int k = 0; k < POINTS; k++)
            CHECK(fmi3DoStep(first, END * k / POINTS, END / POINTS, 0, &event, &ends, &early, &last) == 0);
        CHECK(fmi3GetFloat64(first, &output, 1, round == 0 ? &one : &two, 1) == 0);
        CHECK(fmi3GetDirectionalDerivative(first, &output, 1, &number, 1, &along, 1, &slope, 1) == 0);
        CHECK(fmi3EnterEventMode(first) == 0 && fmi3SetFMUState(first, state) == 0);
    }
    CHECK(one == two && updates > 0 && fmi3GetFloat64(first, &none, 1, &two, 1) != 0);
    CHECK(fmi3GetFloat64(first, &output, 1, &two, 7) != 0 && fmi3FreeFMUState(first, &state) == 0);
    CHECK(fmi3Reset(first) == 0 && fmi3Terminate(first) == 0);
    fmi3FreeInstance(first);
    return 0;
}
#endif
