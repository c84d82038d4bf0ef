// For the thread sanitizer alone. It sees nothing of what libtbb, which is not built with it, does:
// that a task runs after it was spawned, and that its end is waited for. These functions stand
// before those of libtbb that tasks pass through, and tell it so. What then is reported are races
// of ours.
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <thread>

#include <dlfcn.h>
#include <sanitizer/tsan_interface.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

extern "C" const char __executable_start; // where our own code begins
extern "C" const char etext;              // and ends

namespace tbb::detail {
namespace {

using d1::execution_data;
using d1::small_object_pool;
using d1::task;
using d1::task_group_context;
using d1::wait_context;

/// The function that this one hides. \param name  as the linker knows it.
template <class Fn>
Fn* hidden(const char* name) {
    void* found = ::dlsym(RTLD_NEXT, name);
    if (!found)
        std::abort(); // another version of TBB
    return reinterpret_cast<Fn*>(found);
}

/// Tasks of a context that were spawned and have not ended. Libraries that are not built with the
/// sanitizer count theirs off unseen, so who waits for them waits here, too.
class Spawned {
public:
    void add() { n_.fetch_add(1, std::memory_order_relaxed); }
    void end() {
        __tsan_release(this);
        n_.fetch_sub(1, std::memory_order_relaxed);
    }
    bool any() const { return n_.load(std::memory_order_relaxed) > 0; }
    void wait() {
        // Contexts share a number once in a while, and one may be waited for within its own task.
        for (int i = 0; i < 100'000 && any(); ++i)
            std::this_thread::yield();
        __tsan_acquire(this);
    }

private:
    std::atomic<long> n_{0}; // relaxed: is to order nothing by itself
};

Spawned& spawned(const task_group_context& context) {
    static constexpr int kBits = 16;
    static std::array<Spawned, 1 << kBits> by_context;
    const auto address = reinterpret_cast<std::uintptr_t>(&context);
    return by_context[address * 0x9e3779b97f4a7c15u >> (64 - kBits)];
}

/// Stands for a task that was spawned, until that is run.
class Handed final : public task {
public:
    Handed(task& inner, const task_group_context& context)
        : inner_(&inner), spawned_(spawned(context)) {
        spawned_.add();
        __tsan_release(this);
    }

private:
    task* execute(execution_data& data) override {
        return run([&] { return inner_->execute(data); });
    }
    task* cancel(execution_data& data) override {
        return run([&] { return inner_->cancel(data); });
    }
    template <class Run>
    task* run(Run&& inner) {
        __tsan_acquire(this);
        task* const next = inner(); // where it throws, cancel() comes after
        spawned_.end();
        delete this;
        return next;
    }
    task* inner_;
    Spawned& spawned_;
};

/// What was done by tasks is seen by who waited for them, be it that one threw.
struct Waited {
    const task_group_context& on;
    ~Waited() { spawned(on).wait(); }
};

/// The same of a function that may run in another thread.
class HandedCall final : public d1::delegate_base {
public:
    explicit HandedCall(d1::delegate_base& inner) : inner_(inner) { __tsan_release(&inner_); }
    ~HandedCall() override { __tsan_acquire(&inner_); }
    bool operator()() const override {
        __tsan_acquire(&inner_);
        const bool result = inner_();
        __tsan_release(&inner_);
        return result;
    }

private:
    d1::delegate_base& inner_;
};

/// Whether what a call returns to is a library's code. None is built with the sanitizer:
/// what its tasks do cannot be judged, and the templates of TBB in it join their results unseen,
/// which looks like a race. So they run in one thread.
bool of_library(const void* returned_to) {
    const auto at = reinterpret_cast<std::uintptr_t>(returned_to);
    return at < reinterpret_cast<std::uintptr_t>(&__executable_start) ||
           at >= reinterpret_cast<std::uintptr_t>(&etext);
}

void* fresh(std::size_t n_bytes) {
    constexpr std::size_t kLine = 64;
    void* const memory = std::aligned_alloc(kLine, (n_bytes + kLine - 1) / kLine * kLine);
    if (!memory)
        throw std::bad_alloc();
    return memory;
}

} // namespace

namespace r1 {

void spawn(task& t, task_group_context& context) {
    static auto* const real = hidden<void(task&, task_group_context&)>(
        "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextE");
    real(*new Handed(t, context), context);
}

void spawn(task& t, task_group_context& context, d1::slot_id slot) {
    static auto* const real = hidden<void(task&, task_group_context&, d1::slot_id)>(
        "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextEt");
    real(*new Handed(t, context), context, slot);
}

void execute_and_wait(task& t, task_group_context& of_task, wait_context& waited,
                      task_group_context& of_wait) {
    static auto* const real =
        hidden<void(task&, task_group_context&, wait_context&, task_group_context&)>(
            "_ZN3tbb6detail2r116execute_and_waitERNS0_2d14taskERNS2_18task_group_contextERNS2_12"
            "wait_contextES6_");
    const Waited after{of_wait};
    if (of_library(__builtin_return_address(0)) && !spawned(of_wait).any()) // none lies elsewhere
        d1::task_arena(1).execute([&] { real(t, of_task, waited, of_wait); });
    else
        real(t, of_task, waited, of_wait);
}

void wait(wait_context& waited, task_group_context& context) {
    static auto* const real = hidden<void(wait_context&, task_group_context&)>(
        "_ZN3tbb6detail2r14waitERNS0_2d112wait_contextERNS2_18task_group_contextE");
    const Waited after{context};
    real(waited, context);
}

void execute(d1::task_arena_base& arena, d1::delegate_base& call) {
    static auto* const real = hidden<void(d1::task_arena_base&, d1::delegate_base&)>(
        "_ZN3tbb6detail2r17executeERNS0_2d115task_arena_baseERNS2_13delegate_baseE");
    if (of_library(__builtin_return_address(0))) {
        d1::task_arena(1).execute([&] { call(); });
    } else {
        HandedCall handed(call);
        real(arena, handed);
    }
}

// Its pools hand memory from thread to thread, too.
void* allocate(small_object_pool*&, std::size_t n_bytes, const execution_data&) {
    return fresh(n_bytes);
}
void* allocate(small_object_pool*&, std::size_t n_bytes) {
    return fresh(n_bytes);
}
void deallocate(small_object_pool&, void* memory, std::size_t, const execution_data&) {
    std::free(memory);
}
void deallocate(small_object_pool&, void* memory, std::size_t) {
    std::free(memory);
}

} // namespace r1
} // namespace tbb::detail
