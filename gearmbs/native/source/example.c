/* Goes through the span of an exported model in a hundred parts and prints an output at each. */

#include "gearmbs.h"

#include <stdio.h>
#include <stdlib.h>

int main(void) {
    gearmbs_instance *instance = gearmbs_create();
    double *outputs = malloc((gearmbs_outputs() + 1) * sizeof *outputs);
    double start = gearmbs_start_time(), end = gearmbs_end_time();
    int code = GEARMBS_OK;
    if (instance == NULL || outputs == NULL) return 2;
    for (int k = 1; k <= 100 && code == GEARMBS_OK; k++) {
        code = gearmbs_advance(instance, k < 100 ? start + (end - start) * k / 100.0 : end);
        if (code == GEARMBS_OK) code = gearmbs_get(instance, outputs);
        if (code == GEARMBS_OK && gearmbs_outputs() > 0)
            printf("%.9g %.17g %s\n", gearmbs_time(instance), outputs[0], gearmbs_output_unit(0));
    }
    if (code != GEARMBS_OK) fprintf(stderr, "%s\n", gearmbs_message(code));
    gearmbs_free(instance);
    free(outputs);
    return code == GEARMBS_OK ? 0 : 1;
}
