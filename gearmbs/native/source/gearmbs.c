/* Instances of an exported model: memory, and the calls of its compiled kernels. See gearmbs.h. */

#include "gearmbs.h"
#include "model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REACHED = 1, REPIVOT = 4, TOLD = 1, CHOSEN = 0, LINE = 64, DIGEST = 16 };

struct gearmbs_instance {
    unsigned char *memory; /* at the start of a line of the cache, inside of what is allocated */
    void *allocated;
    int failure;
};

static const gearmbs_model *const model = &gearmbs_this;

static void *at(const gearmbs_instance *instance, int64_t offset) { return instance->memory + offset; }

static int64_t read_word(const unsigned char *place) {
    int64_t word;
    memcpy(&word, place, sizeof word);
    return word;
}

static void write_word(unsigned char *place, int64_t word) { memcpy(place, &word, sizeof word); }

/* Let addresses stand in the first bytes of an instance's memory, where there are offsets and numbers of functions. */
static void put_addresses(unsigned char *memory, int64_t bytes) {
    for (int64_t k = 0; k < model->inside_count && model->inside[k] < bytes; k++) {
        unsigned char *place = memory + model->inside[k];
        write_word(place, read_word(place) + (int64_t)(intptr_t)memory);
    }
    for (int64_t k = 0; k < model->function_count && model->functions[2 * k] < bytes; k++) {
        write_word(memory + model->functions[2 * k], (int64_t)(intptr_t)model->kernels[model->functions[2 * k + 1]]);
    }
}

const char *gearmbs_message(int code) {
    switch (code) {
    case GEARMBS_OK: return "It is done.";
    case GEARMBS_SINGULAR: return "The Newton matrix is singular: some unknown is not determined by the equations.";
    case GEARMBS_NOT_FINITE: return "The equations returned a value that is not finite.";
    case GEARMBS_STEP_TOO_SMALL:
        return "The step size fell to its lower limit before the requested accuracy was reached.";
    case GEARMBS_TOO_MANY_REJECTIONS: return "One step was rejected too many times.";
    case GEARMBS_INCONSISTENT_START: return "The values at a start do not satisfy the equations.";
    case GEARMBS_TOO_MANY_STEPS: return "The limit on the number of steps was reached.";
    case GEARMBS_NEWTON_FAILURE:
        return "The corrector did not converge even with a fresh Jacobian at the smallest step.";
    case GEARMBS_STALLED: return "The steps have become so small that the run would never end.";
    case GEARMBS_BELOW_ROUNDING: return "The tolerance is below the rounding of double precision.";
    case GEARMBS_REFUSED:
        return "An argument is of no use: a number that is not there or not finite, a time that lies before the present "
               "one or behind the end, a state of another model.";
    case GEARMBS_NO_ROOM: return "The factors of a matrix have more entries than the library has room for.";
    case GEARMBS_KERNEL_FAILED: return "A compiled function asked for Python, or for a kernel that was left out.";
    case GEARMBS_OUT_OF_RANGE:
        return "A number cannot have this value, as a stiffness below zero: see gearmbs_number_range.";
    default: return "Unknown code.";
    }
}

const char *gearmbs_model_name(void) { return model->name; }
double gearmbs_start_time(void) { return model->t_start; }
double gearmbs_end_time(void) { return model->t_end; }
size_t gearmbs_numbers(void) { return (size_t)model->numbers; }
size_t gearmbs_outputs(void) { return (size_t)model->outputs; }
size_t gearmbs_unknowns(void) { return (size_t)model->unknowns; }

static const char *text_of(const char *const *texts, int64_t count, size_t k) {
    return k < (size_t)count ? texts[k] : NULL;
}

const char *gearmbs_number_name(size_t k) { return text_of(model->number_names, model->numbers, k); }
const char *gearmbs_number_unit(size_t k) { return text_of(model->number_units, model->numbers, k); }
const char *gearmbs_output_name(size_t k) { return text_of(model->output_names, model->outputs, k); }
const char *gearmbs_output_unit(size_t k) { return text_of(model->output_units, model->outputs, k); }
const char *gearmbs_unknown_name(size_t k) { return text_of(model->unknown_names, model->unknowns, k); }

gearmbs_instance *gearmbs_create(void) {
    gearmbs_instance *made = malloc(sizeof *made);
    void *room = calloc(1, (size_t)model->size + LINE);
    if (made == NULL || room == NULL) {
        free(made);
        free(room);
        return NULL;
    }
    made->allocated = room;
    made->memory = (unsigned char *)room + (LINE - (uintptr_t)room % LINE) % LINE;
    made->failure = GEARMBS_OK;
    const unsigned char *from = gearmbs_block;
    for (int64_t k = 0; k < model->piece_count; k++) {
        size_t bytes = (size_t)(model->pieces[2 * k + 1] - model->pieces[2 * k]);
        memcpy(made->memory + model->pieces[2 * k], from, bytes);
        from += bytes;
    }
    put_addresses(made->memory, model->block);
    return made;
}

void gearmbs_free(gearmbs_instance *instance) {
    if (instance != NULL) {
        free(instance->allocated);
        free(instance);
    }
}

double gearmbs_time(const gearmbs_instance *instance) {
    double t;
    memcpy(&t, at(instance, model->time), sizeof t);
    return t;
}

double gearmbs_integrated(const gearmbs_instance *instance) {
    double t;
    memcpy(&t, at(instance, model->integrated), sizeof t);
    return t;
}

long long gearmbs_steps(const gearmbs_instance *instance) { return read_word(at(instance, model->steps)); }

int gearmbs_number_range(size_t number, double *least, double *most) {
    if (number >= gearmbs_numbers()) return GEARMBS_REFUSED;
    *least = model->least[number];
    *most = model->most[number];
    return GEARMBS_OK;
}

int gearmbs_set(gearmbs_instance *instance, size_t number, double value) {
    if (number < gearmbs_numbers() && (value < model->least[number] || value > model->most[number]))
        return isinf(value) ? GEARMBS_REFUSED : GEARMBS_OUT_OF_RANGE;
    return gearmbs_put(instance, number, value);
}

int gearmbs_put(gearmbs_instance *instance, size_t number, double value) {
    if (number >= gearmbs_numbers() || !(value - value == 0.0)) return GEARMBS_REFUSED;
    write_word((unsigned char *)at(instance, model->waiting) + 8 * number, 1);
    memcpy((unsigned char *)at(instance, model->wanted) + 8 * number, &value, sizeof value);
    return GEARMBS_OK;
}

int gearmbs_number(gearmbs_instance *instance, size_t number, double *value) {
    void *error = NULL;
    if (number >= gearmbs_numbers()) return GEARMBS_REFUSED;
    if (gearmbs_present_value(value, &error, at(instance, model->run), at(instance, model->driver), (int64_t)number))
        return GEARMBS_KERNEL_FAILED;
    return GEARMBS_OK;
}

#ifdef gearmbs_start_afresh
/* Start afresh where an input that prescribes a motion has been set, or anything before the first step. */
static int start_afresh(gearmbs_instance *i) {
    const motion_tables *tables = model->motions;
    int64_t *waiting = at(i, model->waiting), code = 0, steps = gearmbs_steps(i);
    void *error = NULL;
    int due = 0;
    for (int64_t k = 0; k < tables->numbers; k++) due |= waiting[k] && (tables->prescribes[k] || steps == 0);
    if (!due || !gearmbs_new_numbers(tables, gearmbs_time(i), at(i, tables->rdata), at(i, tables->values), waiting,
                                     at(i, model->wanted)))
        return GEARMBS_OK;
    for (int64_t k = 0; k < tables->copies; k++)
        memcpy(at(i, tables->copy[3 * k + 1]), at(i, tables->copy[3 * k]), (size_t)tables->copy[3 * k + 2]);
    if (gearmbs_start_afresh(&code, &error, at(i, model->bound), at(i, model->run), at(i, model->part),
                             at(i, model->plan), at(i, model->factors), at(i, model->driver), at(i, model->room),
                             at(i, model->columns), at(i, model->rows), at(i, tables->afresh),
                             steps > 0 || gearmbs_time(i) > tables->t_first))
        return GEARMBS_KERNEL_FAILED;
    return (int)code;
}
#endif

/* Let what has been set take effect at the present time. */
static int apply(gearmbs_instance *i, int64_t shows) {
    void *error = NULL;
    int64_t changes;
#ifdef gearmbs_start_afresh
    if (i->failure == GEARMBS_OK) i->failure = start_afresh(i);
#endif
    if (i->failure == GEARMBS_OK &&
        gearmbs_apply(&changes, &error, at(i, model->bound), at(i, model->run), at(i, model->plan),
                      at(i, model->factors), at(i, model->driver), shows))
        i->failure = GEARMBS_KERNEL_FAILED;
    return i->failure;
}

int gearmbs_take_effect(gearmbs_instance *instance) { return apply(instance, 1); }

/* Go on to a time, with new pivots on the way where they are asked for. */
static int go(gearmbs_instance *i, double t) {
    void *error = NULL, *run = at(i, model->run), *driver = at(i, model->driver);
    void *plan = at(i, model->plan), *factors = at(i, model->factors);
    int64_t code;
    for (;;) {
        if (gearmbs_go_to(&code, &error, at(i, model->bound), run, at(i, model->part), plan, factors, driver, t))
            return GEARMBS_KERNEL_FAILED;
        if (code != REPIVOT) return code == REACHED ? GEARMBS_OK : (int)code;
        if (gearmbs_choose_for_run(&code, &error, run, driver, at(i, model->room), at(i, model->columns),
                                   at(i, model->rows), plan, factors))
            return GEARMBS_KERNEL_FAILED;
        if (code < 0) return (int)code;
    }
}

/* Evaluate what is told at the present point. */
static int look(gearmbs_instance *i) {
    void *error = NULL, *run = at(i, model->run), *driver = at(i, model->driver), *teller = at(i, model->teller);
    void *plan = at(i, model->told_plan), *factors = at(i, model->told_factors);
    int64_t code;
    for (int64_t first = 1;; first = 0) {
        if (gearmbs_tell(&code, &error, run, driver, teller, plan, factors, first)) return GEARMBS_KERNEL_FAILED;
        if (code == TOLD) return GEARMBS_OK;
        if (gearmbs_choose_for_outputs(&code, &error, run, driver, teller, at(i, model->told_room),
                                       at(i, model->told_columns), at(i, model->told_rows), plan, factors))
            return GEARMBS_KERNEL_FAILED;
        if (code != CHOSEN) return (int)code;
        if (gearmbs_factor_for_outputs(&code, &error, driver, teller, plan, factors))
            return GEARMBS_KERNEL_FAILED;
    }
}

int gearmbs_advance(gearmbs_instance *instance, double time) {
    if (instance->failure != GEARMBS_OK) return instance->failure;
    if (!(time >= gearmbs_time(instance) && time <= model->t_end)) return GEARMBS_REFUSED;
    if (time == gearmbs_time(instance)) return GEARMBS_OK;
    /* angles are counted from the point that is left */
    if (model->counts) instance->failure = look(instance);
    if (apply(instance, 0) == GEARMBS_OK) instance->failure = go(instance, time);
    return instance->failure;
}

int gearmbs_get(gearmbs_instance *instance, double *outputs) {
    if (instance->failure != GEARMBS_OK) return instance->failure;
    int code = look(instance);
    if (code == GEARMBS_OK) memcpy(outputs, at(instance, model->out), 8 * gearmbs_outputs());
    return code;
}

int gearmbs_get_unknowns(const gearmbs_instance *instance, double *values, double *rates) {
    size_t bytes = 8 * gearmbs_unknowns(), row = (size_t)read_word(at(instance, model->present)) * bytes;
    if (values != NULL) memcpy(values, (unsigned char *)at(instance, model->values) + row, bytes);
    if (rates != NULL) memcpy(rates, (unsigned char *)at(instance, model->rates) + row, bytes);
    return GEARMBS_OK;
}

size_t gearmbs_state_size(void) { return DIGEST + (size_t)model->state; }

int gearmbs_save(gearmbs_instance *instance, void *state) {
    unsigned char *copy = (unsigned char *)state + DIGEST;
    if (apply(instance, 0) != GEARMBS_OK) return instance->failure;
    memcpy(state, model->digest, DIGEST);
    memcpy(copy, instance->memory, (size_t)model->state);
    /* offsets and numbers travel, addresses do not */
    for (int64_t k = 0; k < model->inside_count && model->inside[k] < model->state; k++) {
        unsigned char *place = copy + model->inside[k];
        write_word(place, read_word(place) - (int64_t)(intptr_t)instance->memory);
    }
    for (int64_t k = 0; k < model->function_count && model->functions[2 * k] < model->state; k++)
        write_word(copy + model->functions[2 * k], model->functions[2 * k + 1]);
    return GEARMBS_OK;
}

int gearmbs_restore(gearmbs_instance *instance, const void *state, size_t size) {
    if (size != gearmbs_state_size() || memcmp(state, model->digest, DIGEST) != 0) return GEARMBS_REFUSED;
    memcpy(instance->memory, (const unsigned char *)state + DIGEST, (size_t)model->state);
    put_addresses(instance->memory, model->state);
    instance->failure = GEARMBS_OK;
    return GEARMBS_OK;
}
