#include "platform/os/mapped_region.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <utility>

namespace axlecast {
namespace {

// The signal handler may come in the middle of anything: no lock, no memory of the heap.
struct Slot {
  std::atomic<bool> taken = false;
  std::atomic<bool> fell = false;
  std::atomic<int> file = -1;
  std::atomic<std::uintptr_t> begin = 0;
  std::atomic<std::size_t> size = 0;  // whole pages; 0: nothing is mapped
};
static_assert(std::atomic<std::uintptr_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

std::array<Slot, MappedRegion::kMax> slots;
struct sigaction before_us {};

std::size_t PageSize() {
  static const auto kSize = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return kSize;
}

// Puts zeros into the page at `offset`, and where the file ends before it also into all that follow. Only bare system
// calls.
bool Fill(Slot& slot, std::size_t offset) {
  struct stat status {};
  const bool ended = fstat(slot.file, &status) == 0 && static_cast<std::size_t>(status.st_size) <= offset;
  const std::size_t size = ended ? slot.size - offset : PageSize();
  void* const at = reinterpret_cast<void*>(slot.begin + offset);
  slot.fell = true;
  return mmap(at, size, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED | MAP_NORESERVE, -1, 0) != MAP_FAILED;
}

void OnBusError(int, siginfo_t* info, void*) {
  const int error = errno;
  const auto address = reinterpret_cast<std::uintptr_t>(info->si_addr);
  for (Slot& slot : slots) {
    const std::size_t offset = address - slot.begin;  // beyond every size where it is before
    if (info->si_code != BUS_ADRERR || offset >= slot.size) continue;
    if (!Fill(slot, offset / PageSize() * PageSize())) break;
    errno = error;
    return;
  }
  // None of ours: it does what it would have done without us, when the instruction fails again or it is sent again.
  sigaction(SIGBUS, &before_us, nullptr);
  if (info->si_code <= 0) static_cast<void>(raise(SIGBUS));
}

bool TakeSignal() {
  static_cast<void>(PageSize());  // not first in the handler
  struct sigaction action {};
  action.sa_sigaction = OnBusError;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK;
  sigemptyset(&action.sa_mask);
  return sigaction(SIGBUS, &action, &before_us) == 0;
}

std::size_t TakeSlot() {
  std::size_t slot = 0;
  while (slot < slots.size() && slots[slot].taken.exchange(true)) ++slot;
  return slot;
}

}  // namespace

MappedRegion::MappedRegion(Descriptor file, std::size_t size) : file_(std::move(file)) {
  static const bool kReady = TakeSignal();
  if (slot_ = kReady ? TakeSlot() : kMax; slot_ == kMax) {
    error_ = EMFILE;
    return;
  }
  void* const data = mmap(nullptr, size, PROT_READ, MAP_SHARED, file_.get(), 0);
  if (data == MAP_FAILED) {
    error_ = errno;
    return;
  }
  static_cast<void>(madvise(data, size, MADV_SEQUENTIAL));  // a hint
  bytes_ = {static_cast<const std::uint8_t*>(data), size};
  Slot& slot = slots[slot_];
  slot.fell = false;
  slot.file = file_.get();
  slot.begin = reinterpret_cast<std::uintptr_t>(data);
  slot.size = (size + PageSize() - 1) / PageSize() * PageSize();
}

MappedRegion::~MappedRegion() {
  if (slot_ == kMax) return;
  Slot& slot = slots[slot_];
  slot.size = 0;
  if (!bytes_.empty()) munmap(const_cast<std::uint8_t*>(bytes_.data()), bytes_.size());
  slot.taken = false;
}

std::size_t MappedRegion::Left() const {
  struct stat status {};
  if (fstat(file_.get(), &status) != 0) return bytes_.size();
  return std::min(bytes_.size(), static_cast<std::size_t>(status.st_size));
}

bool MappedRegion::fell() const { return slot_ < kMax && slots[slot_].fell; }

}  // namespace axlecast
