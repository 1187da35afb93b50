/* The library from C++: an instance that frees itself and throws what failed, and two of them in threads of their own. */

#include "gearmbs.h"

#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

class Simulation {
  public:
    Simulation() : instance(gearmbs_create(), gearmbs_free) {
        if (!instance) throw std::bad_alloc();
    }
    double time() const { return gearmbs_time(instance.get()); }
    void set(std::size_t number, double value) { check(gearmbs_set(instance.get(), number, value)); }
    void advance(double to) { check(gearmbs_advance(instance.get(), to)); }
    std::vector<double> outputs() {
        std::vector<double> values(gearmbs_outputs() + 1);
        check(gearmbs_get(instance.get(), values.data()));
        values.resize(gearmbs_outputs());
        return values;
    }
    std::vector<unsigned char> save() {
        std::vector<unsigned char> state(gearmbs_state_size());
        check(gearmbs_save(instance.get(), state.data()));
        return state;
    }
    void restore(const std::vector<unsigned char> &state) {
        check(gearmbs_restore(instance.get(), state.data(), state.size()));
    }

  private:
    static void check(int code) {
        if (code != GEARMBS_OK) throw std::runtime_error(gearmbs_message(code));
    }
    std::unique_ptr<gearmbs_instance, void (*)(gearmbs_instance *)> instance;
};

int main() {
    const double start = gearmbs_start_time(), end = gearmbs_end_time();
    std::vector<std::vector<double>> found(2);
    std::exception_ptr failed;
    try {
        Simulation first;
        first.advance(start + 0.5 * (end - start));
        const auto half_way = first.save();
        std::vector<std::thread> threads;
        /* from one state two instances go the same way */
        for (std::size_t k = 0; k < found.size(); k++)
            threads.emplace_back([&, k] {
                try {
                    Simulation other;
                    other.restore(half_way);
                    other.advance(end);
                    found[k] = other.outputs();
                } catch (...) { failed = std::current_exception(); }
            });
        for (auto &thread : threads) thread.join();
        if (failed) std::rethrow_exception(failed);
        first.advance(end);
        if (found[0] != found[1] || found[0] != first.outputs()) throw std::logic_error("instances differ");
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    for (std::size_t k = 0; k < found[0].size(); k++)
        std::printf("%s %.17g %s\n", gearmbs_output_name(k), found[0][k], gearmbs_output_unit(k));
    return 0;
}
