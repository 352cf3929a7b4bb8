#pragma once

#include <ucontext.h>

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>

namespace axlecast::simulation {

// Thrown in a fiber that is killed, so that its stack unwinds.
struct FiberKilled {};

// A thread of a simulated process: it has a stack of its own, and runs only while the simulation waits in Resume. So the product's code
// can wait in the middle of a call, and the whole simulation is one thread.
class Fiber {
 public:
  explicit Fiber(std::function<void()> body);
  ~Fiber();  // kills it
  Fiber(const Fiber&) = delete;
  Fiber& operator=(const Fiber&) = delete;

  // Runs the body until it calls Suspend or ends. Throws what the body has thrown.
  void Resume();
  // From inside: returns when the fiber is resumed. Throws FiberKilled if it is killed.
  void Suspend();
  // Unwinds the stack of a fiber that is suspended.
  void Kill();
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  static constexpr std::size_t kStack = 512U << 10;

  static void Enter(unsigned high, unsigned low);
  void Run();
  void SwitchIn();
  void SwitchOut(bool for_ever);

  std::function<void()> body_;
  std::unique_ptr<std::byte[]> stack_;
  ucontext_t inside_{};
  ucontext_t outside_{};
  std::exception_ptr failure_;
  bool started_ = false;
  bool ended_ = false;
  bool killed_ = false;
  // The address sanitizer keeps a state for each stack.
  void* inside_state_ = nullptr;
  void* outside_state_ = nullptr;
  const void* outside_bottom_ = nullptr;
  std::size_t outside_size_ = 0;
};

}  // namespace axlecast::simulation
