/* See fmu.h. */

#include "fmu.h"
#include "model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double SAME_TIME = 1e-9; /* part of the time within which importers may have rounded it */

/* Part of a value, or of one in its unit, by which it is moved for a derivative at first, and by what it is divided when
   outputs bend within it, as of numbers that are small in their unit: as long as that brings differences of second
   order over one and two steps nearer to each other. Those of fourth order miss less than the part that they may differ
   by, squared, of what is smooth. */
static const double MOVED = 1e-3, FINER = 10.0, ALIKE = 1e-6;
static const double ROUNDED = 1e-12; /* part of a value below which differences of it are those of rounding */
enum { FINEST = 12 };

static double span_of(double t) { return SAME_TIME * (t > 1.0 ? t : 1.0); }

/* Tell why something has not been done. */
int fmu_refuse(const fmu *self, const char *message) {
    if (self->tell != NULL) self->tell(self, FMU_ERROR, message);
    return FMU_ERROR;
}

static int status_of(const fmu *self, int code) {
    return code == GEARMBS_OK ? FMU_OK : fmu_refuse(self, gearmbs_message(code));
}

fmu *fmu_new(const char *name, const char *token, void *environment, void *logger,
             void (*tell)(const fmu *, int, const char *)) {
    fmu *made = calloc(1, sizeof *made);
    if (made == NULL) return NULL;
    made->environment = environment;
    made->logger = logger;
    made->tell = logger == NULL ? NULL : tell;
    made->name = malloc(strlen(name) + 1);
    made->outputs = malloc((gearmbs_outputs() + 1) * sizeof *made->outputs);
    made->instance = gearmbs_create();
    if (made->name != NULL) strcpy(made->name, name);
    if (made->name == NULL || made->outputs == NULL || made->instance == NULL ||
        (token != NULL && strcmp(token, gearmbs_this.token) != 0)) {
        if (made->name != NULL) fmu_refuse(made, "The description is that of another model, or memory is short.");
        fmu_free(made);
        return NULL;
    }
    return made;
}

void fmu_free(fmu *self) {
    if (self == NULL) return;
    gearmbs_free(self->instance);
    free(self->outputs);
    free(self->name);
    free(self);
}

/* Write the values of variables; what has been set at the present time has taken effect in them. */
int fmu_get(fmu *self, const unsigned *references, size_t count, double *values) {
    size_t numbers = gearmbs_numbers();
    for (size_t k = 0; k < count; k++) {
        unsigned r = references[k];
        int code = GEARMBS_OK;
        if (r < numbers) {
            code = gearmbs_number(self->instance, r, &values[k]);
        } else if (r - numbers == gearmbs_outputs()) {
            values[k] = gearmbs_time(self->instance);
        } else if (r - numbers > gearmbs_outputs()) {
            return fmu_refuse(self, "There is no variable of this reference.");
        } else {
            if (!self->known) code = gearmbs_take_effect(self->instance);
            if (code == GEARMBS_OK && !self->known) code = gearmbs_get(self->instance, self->outputs);
            self->known = code == GEARMBS_OK;
            values[k] = self->outputs[r - numbers];
        }
        if (code != GEARMBS_OK) return status_of(self, code);
    }
    return FMU_OK;
}

/* Tell which variable cannot have a value, and which it can have. */
static int out_of_range(const fmu *self, unsigned reference, double value) {
    char text[400];
    double least, most;
    gearmbs_number_range(reference, &least, &most);
    snprintf(text, sizeof text, "%.200s = %.9g: it must lie between %.9g and %.9g.", gearmbs_number_name(reference), value,
             least, most);
    return fmu_refuse(self, text);
}

int fmu_set(fmu *self, const unsigned *references, size_t count, const double *values) {
    for (size_t k = 0; k < count; k++) {
        int code = gearmbs_set(self->instance, references[k], values[k]);
        if (code == GEARMBS_OUT_OF_RANGE) return out_of_range(self, references[k], values[k]);
        if (code != GEARMBS_OK) return status_of(self, code);
    }
    self->known = 0;
    return FMU_OK;
}

/* Write the outputs with some numbers moved by a part of a direction; the instance is then as it was. */
static int moved(fmu *self, const void *state, const unsigned *known, size_t columns, const double *from,
                 const double *along, double part) {
    int code = GEARMBS_OK;
    for (size_t k = 0; k < columns && code == GEARMBS_OK; k++)
        code = gearmbs_put(self->instance, known[k], from[k] + part * along[k]);
    if (code == GEARMBS_OK) code = gearmbs_take_effect(self->instance);
    if (code == GEARMBS_OK) code = gearmbs_get(self->instance, self->outputs);
    int back = gearmbs_restore(self->instance, state, gearmbs_state_size());
    self->known = 0;
    return code == GEARMBS_OK ? back : code;
}

/* Write differences of outputs over one step and over two, of second order. */
static int differences(fmu *self, const void *state, const unsigned *unknowns, size_t rows, const unsigned *known,
                       size_t columns, const double *from, const double *along, double step, double *one, double *two) {
    static const double SIDES[] = {1.0, -1.0};
    int code = GEARMBS_OK;
    for (size_t r = 0; r < rows; r++) one[r] = two[r] = 0.0;
    for (int width = 1; width <= 2; width++)
        for (int side = 0; side < 2 && code == GEARMBS_OK; side++) {
            double *sum = width == 1 ? one : two;
            code = moved(self, state, known, columns, from, along, SIDES[side] * width * step);
            for (size_t r = 0; r < rows && code == GEARMBS_OK; r++)
                sum[r] += SIDES[side] / (2.0 * width * step) * self->outputs[unknowns[r] - gearmbs_numbers()];
        }
    return code;
}

static double size_of(double value) { return value < 0.0 ? -value : value; }

/* Write the derivative of outputs at the present time along a direction of the numbers that can be set, the motion so
   far held: with d(h) = (f(h) - f(-h)) / (2 h) it is f' = (4 d(h) - d(2 h)) / 3 + O(h^4), h that of least
   |d(h) - d(2 h)|. */
int fmu_derivative(fmu *self, const unsigned *unknowns, size_t rows, const unsigned *known, size_t columns,
                   const double *along, double *values) {
    size_t numbers = gearmbs_numbers();
    double step = 0.0;
    for (size_t k = 0; k < rows; k++)
        if (unknowns[k] < numbers || unknowns[k] - numbers >= gearmbs_outputs())
            return fmu_refuse(self, "Derivatives are those of outputs.");
    for (size_t k = 0; k < columns; k++)
        if (known[k] >= numbers) return fmu_refuse(self, "Derivatives are those by inputs and parameters.");
    for (size_t k = 0; k < rows; k++) values[k] = 0.0;
    void *state = malloc(gearmbs_state_size());
    double *from = malloc((columns + 3 * rows + 1) * sizeof *from);
    int code = state == NULL || from == NULL ? GEARMBS_NO_ROOM : gearmbs_save(self->instance, state);
    for (size_t k = 0; k < columns && code == GEARMBS_OK; k++) {
        code = gearmbs_number(self->instance, known[k], &from[k]);
        /* the largest step that moves no number by more than its part */
        double size = size_of(from[k]), rate = size_of(along[k]);
        double own = rate > 0.0 ? MOVED * (size > 1.0 ? size : 1.0) / rate : 0.0;
        if (own > 0.0 && (step == 0.0 || own < step)) step = own;
    }
    int open = step > 0.0;
    for (int k = 0; k < FINEST && open && code == GEARMBS_OK; k++, step /= FINER) {
        double *one = from + columns, *two = one + rows, *apart = two + rows;
        code = differences(self, state, unknowns, rows, known, columns, from, along, step, one, two);
        open = 0;
        for (size_t r = 0; r < rows && code == GEARMBS_OK; r++) {
            double miss = size_of(one[r] - two[r]), scale = size_of(one[r]);
            if (k == 0 || miss < apart[r]) {
                apart[r] = miss;
                values[r] = (4.0 * one[r] - two[r]) / 3.0;
            }
            double rounding = ROUNDED * size_of(self->outputs[unknowns[r] - numbers]) / step;
            if (!(apart[r] <= ALIKE * scale || apart[r] <= rounding)) open = 1;
        }
    }
    free(state);
    free(from);
    return status_of(self, code);
}

int fmu_span(const fmu *self, double start, int has_stop, double stop) {
    char text[200];
    double first = gearmbs_start_time(), last = gearmbs_end_time();
    if (start >= first - span_of(first) && start <= first + span_of(first) && !(has_stop && stop > last + span_of(last)))
        return FMU_OK;
    snprintf(text, sizeof text, "The model was exported for %.9g s to %.9g s; start there, or export it with a later end.",
             first, last);
    return fmu_refuse(self, text);
}

/* Write the end of a step from a time, which is the present one but for rounding. */
int fmu_end(const fmu *self, double time, double size, double *end) {
    double now = gearmbs_time(self->instance), last = gearmbs_end_time();
    *end = time + size;
    if (time < now - span_of(now) || time > now + span_of(now) || !(size >= 0.0))
        return fmu_refuse(self, "The step does not begin at the present time, or goes back.");
    if (*end > last && *end <= last + span_of(last)) *end = last;
    return FMU_OK;
}

/* Go on to a time, unless it is passed. */
int fmu_go(fmu *self, double end) {
    self->known = 0;
    return end <= gearmbs_time(self->instance) ? FMU_OK : status_of(self, gearmbs_advance(self->instance, end));
}

int fmu_step(fmu *self, double time, double size) {
    double end;
    int status = fmu_end(self, time, size, &end);
    return status == FMU_OK ? fmu_go(self, end) : status;
}

/* Return the end of the step of the integrator under way, or a time within the next one. */
double fmu_next(const fmu *self) {
    double now = gearmbs_time(self->instance), end = gearmbs_integrated(self->instance);
    return end > now ? end : nextafter(now, HUGE_VAL);
}

int fmu_reset(fmu *self) {
    gearmbs_instance *fresh = gearmbs_create();
    if (fresh == NULL) return fmu_refuse(self, "Memory is short.");
    gearmbs_free(self->instance);
    self->instance = fresh;
    self->known = 0;
    return FMU_OK;
}

/* Write the state, into memory that is made where there is none. */
int fmu_save(fmu *self, void **state) {
    if (*state == NULL) *state = malloc(gearmbs_state_size());
    if (*state == NULL) return fmu_refuse(self, "Memory is short.");
    return status_of(self, gearmbs_save(self->instance, *state));
}

int fmu_restore(fmu *self, const void *state, size_t size) {
    self->known = 0;
    return status_of(self, gearmbs_restore(self->instance, state, size));
}
