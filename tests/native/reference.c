/* Small models of FMI 2.0 for Co-Simulation by explicit Euler steps of a size STEP, as those by which importers are
   tried. MODEL says which: a bouncing ball, Dahlquist's equation, van der Pol's oscillator, a controller of proportion and integral. */

#include <stdlib.h>
#include <string.h>

#define BALL 0
#define DAHLQUIST 1
#define VAN_DER_POL 2
#define CONTROLLER 3
enum { STATES = 2, NUMBERS = 6 };

/* x: states, p: parameters, u: the input, rates: those of the states. */
typedef struct {
    double x[STATES], p[2], u, y;
} model;

static const model START =
#if MODEL == BALL
    {{1.0, 0.0}, {-9.81, 0.7}, 0.0, 0.0};
#elif MODEL == DAHLQUIST
    {{1.0, 0.0}, {1.0, 0.0}, 0.0, 0.0};
#elif MODEL == VAN_DER_POL
    {{2.0, 0.0}, {1.0, 0.0}, 0.0, 0.0};
#else
    {{0.0, 0.0}, {1.0, 20.0}, 0.0, 0.0};
#endif

static void derive(const model *m, double *rates) {
    rates[0] = rates[1] = 0.0;
#if MODEL == BALL
    rates[0] = m->x[1], rates[1] = m->p[0];
#elif MODEL == DAHLQUIST
    rates[0] = -m->p[0] * m->x[0];
#elif MODEL == VAN_DER_POL
    rates[0] = m->x[1], rates[1] = m->p[0] * ((1.0 - m->x[0] * m->x[0]) * m->x[1]) - m->x[0];
#else
    rates[0] = m->u;
#endif
}

static void step(model *m) {
    double rates[STATES];
    derive(m, rates);
    for (int k = 0; k < STATES; k++) m->x[k] += STEP * rates[k];
    if (MODEL == BALL && m->x[0] <= 0.0 && m->x[1] < 0.0) {
        m->x[0] = 0.0;
        m->x[1] *= -m->p[1];
    }
}

static double *place(model *m, unsigned reference) {
    m->y = m->p[0] * m->u + m->p[1] * m->x[0];
    double *all[NUMBERS] = {&m->x[0], &m->x[1], &m->p[0], &m->p[1], &m->u, &m->y};
    return reference < NUMBERS ? all[reference] : NULL;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place, const void *functions, int visible,
                      int logging) {
    (void)name, (void)kind, (void)guid, (void)place, (void)functions, (void)visible, (void)logging;
    model *made = malloc(sizeof *made);
    return made == NULL ? NULL : memcpy(made, &START, sizeof START);
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int a, double b, double d, int e, double f) {
    return (void)c, (void)a, (void)b, (void)d, (void)e, (void)f, 0;
}
int fmi2EnterInitializationMode(void *c) { return (void)c, 0; }
int fmi2ExitInitializationMode(void *c) { return (void)c, 0; }
int fmi2Terminate(void *c) { return (void)c, 0; }
int fmi2Reset(void *c) { return memcpy(c, &START, sizeof START), 0; }
int fmi2GetReal(void *c, const unsigned *references, size_t n, double *values) {
    for (size_t k = 0; k < n; k++) values[k] = *place(c, references[k]);
    return 0;
}
int fmi2SetReal(void *c, const unsigned *references, size_t n, const double *values) {
    for (size_t k = 0; k < n; k++) *place(c, references[k]) = values[k];
    return 0;
}
int fmi2DoStep(void *c, double t, double size, int no_way_back) {
    (void)t, (void)no_way_back;
    for (int left = (int)(size / STEP + 0.5); left > 0; left--) step(c);
    return 0;
}
int fmi2GetFMUstate(void *c, void **state) {
    if (*state == NULL) *state = malloc(sizeof(model));
    return memcpy(*state, c, sizeof(model)), 0;
}
int fmi2SetFMUstate(void *c, void *state) { return memcpy(c, state, sizeof(model)), 0; }
int fmi2FreeFMUstate(void *c, void **state) { return (void)c, free(*state), *state = NULL, 0; }
int fmi2SerializedFMUstateSize(void *c, void *state, size_t *size) {
    return (void)c, (void)state, *size = sizeof(model), 0;
}
int fmi2SerializeFMUstate(void *c, void *state, char *bytes, size_t size) {
    return (void)c, memcpy(bytes, state, size), 0;
}
int fmi2DeSerializeFMUstate(void *c, const char *bytes, size_t size, void **state) {
    return (void)c, *state = malloc(size), memcpy(*state, bytes, size), 0;
}

/* What importers look for, and none of these models has: other types, derivatives, steps that go on by themselves. */
#define NONE(name)                                                                                                     \
    int name(void) { return 3; }
NONE(fmi2SetDebugLogging)
NONE(fmi2GetInteger)
NONE(fmi2SetInteger)
NONE(fmi2GetBoolean)
NONE(fmi2SetBoolean)
NONE(fmi2GetString)
NONE(fmi2SetString)
NONE(fmi2GetDirectionalDerivative)
NONE(fmi2SetRealInputDerivatives)
NONE(fmi2GetRealOutputDerivatives)
NONE(fmi2CancelStep)
NONE(fmi2GetStatus)
NONE(fmi2GetRealStatus)
NONE(fmi2GetIntegerStatus)
NONE(fmi2GetBooleanStatus)
NONE(fmi2GetStringStatus)
