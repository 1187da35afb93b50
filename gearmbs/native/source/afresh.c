/* Inputs that prescribe motions: numbers as they are to stand in the tables, and a state as it was before all steps.
   Arithmetic is that of Python, which does not contract. */

#include "model.h"

#include <string.h>

typedef struct {
    double *values;
    const motion_place *place;
} placed;

/* The number of ways to take some of so many in order, as math.perm. */
static double ways(int64_t all, int64_t taken) {
    double found = 1.0;
    for (int64_t k = 0; k < taken; k++) found *= (double)(all - k);
    return found;
}

/* Let a number be so much from a time on; its integrals go on from where they are. */
static void write_place(placed own, double t, double value) {
    double *table = own.values + own.place->at, known[MOTION_ORDERS];
    int64_t size = own.place->size, order = own.place->order;
    if (order == 0) {
        if (size == 0) {
            table[0] = own.place->offset + own.place->factor * value;
            return;
        }
        table[0] = t;
        table[1] = value;
        if (size > 1) table[2] = 0.0;
        return;
    }
    double x = t - table[0];
    for (int64_t o = 0; o < order; o++) {
        known[o] = 0.0;
        for (int64_t k = size - 1; k >= o; k--) known[o] = known[o] * x + table[1 + k] * ways(k, o);
    }
    table[0] = t;
    for (int64_t k = 0; k < size; k++) table[1 + k] = 0.0;
    for (int64_t k = 0; k <= order + 1; k++) {
        double derivative = k < order ? known[k] : k == order ? value : 0.0;
        table[1 + k] = derivative / ways(k, k);
    }
}

int gearmbs_new_numbers(const motion_tables *tables, double t, const double *rdata, double *values, int64_t *waiting,
                        const double *wanted) {
    int changed = 0;
    for (int64_t c = 0; c < tables->cells; c++) values[c] = rdata[tables->cell[c]];
    for (int64_t k = 0; k < tables->numbers; k++) {
        if (!waiting[k]) continue;
        waiting[k] = 0;
        const motion_place *own = tables->places + tables->first[k];
        double slope = tables->is_input[k] ? values[own->at + 2] : 0.0;
        double now = tables->is_input[k] ? values[own->at + 1] + slope * (t - values[own->at])
                                         : (values[own->at] - own->offset) / own->factor;
        if (wanted[k] == now && slope == 0.0) continue;
        changed = 1;
        for (int64_t p = tables->first[k]; p < tables->first[k + 1]; p++)
            write_place((placed){values, tables->places + p}, t, wanted[k]);
    }
    return changed;
}
