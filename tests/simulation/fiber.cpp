#include "tests/simulation/fiber.h"

#include <cstdint>
#include <utility>

#if defined(__SANITIZE_ADDRESS__)
#define AXLECAST_FIBER_STATES
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define AXLECAST_FIBER_STATES
#endif
#endif
#ifdef AXLECAST_FIBER_STATES
#include <sanitizer/common_interface_defs.h>
#endif

namespace axlecast::simulation {

Fiber::Fiber(std::function<void()> body) : body_(std::move(body)), stack_(std::make_unique<std::byte[]>(kStack)) {
  getcontext(&inside_);
  inside_.uc_stack.ss_sp = stack_.get();
  inside_.uc_stack.ss_size = kStack;
  inside_.uc_link = nullptr;
  // makecontext passes integers only.
  const auto self = reinterpret_cast<std::uintptr_t>(this);
  makecontext(&inside_, reinterpret_cast<void (*)()>(&Fiber::Enter), 2, static_cast<unsigned>(self >> 32U),
              static_cast<unsigned>(self));
}

Fiber::~Fiber() { Kill(); }

void Fiber::Enter(unsigned high, unsigned low) {
  reinterpret_cast<Fiber*>(std::uintptr_t{high} << 32U | low)->Run();
}

void Fiber::Run() {
#ifdef AXLECAST_FIBER_STATES
  __sanitizer_finish_switch_fiber(inside_state_, &outside_bottom_, &outside_size_);
#endif
  try {
    body_();
  } catch (const FiberKilled&) {
  } catch (...) {
    failure_ = std::current_exception();
  }
  ended_ = true;
  SwitchOut(true);
}

void Fiber::SwitchIn() {
#ifdef AXLECAST_FIBER_STATES
  __sanitizer_start_switch_fiber(&outside_state_, stack_.get(), kStack);
#endif
  swapcontext(&outside_, &inside_);
#ifdef AXLECAST_FIBER_STATES
  __sanitizer_finish_switch_fiber(outside_state_, nullptr, nullptr);
#endif
}

void Fiber::SwitchOut([[maybe_unused]] bool for_ever) {
#ifdef AXLECAST_FIBER_STATES
  __sanitizer_start_switch_fiber(for_ever ? nullptr : &inside_state_, outside_bottom_, outside_size_);
#endif
  swapcontext(&inside_, &outside_);
#ifdef AXLECAST_FIBER_STATES
  __sanitizer_finish_switch_fiber(inside_state_, &outside_bottom_, &outside_size_);
#endif
}

void Fiber::Resume() {
  if (ended_) return;
  started_ = true;
  SwitchIn();
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void Fiber::Suspend() {
  SwitchOut(false);
  if (killed_) throw FiberKilled{};
}

void Fiber::Kill() {
  killed_ = true;
  // A destructor on its stack may wait again, which throws no more.
  while (started_ && !ended_) SwitchIn();
  ended_ = true;
}

}  // namespace axlecast::simulation
