#include "platform/os/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <utility>

#include "platform/os/descriptor.h"

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

std::string Remedy(int error) {
  switch (error) {
    case EACCES:
      return ": it takes the right to read it";
    case EMFILE:
      return ": give fewer files at a time, or raise `ulimit -n`";
    case ENOENT:
      return ": check its name";
    default:
      return "";
  }
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

MappedFile::MappedFile(const std::string& path) : path_(path) { Open(); }

FileAccess MappedFile::access() const {
  FileAccess access{.mode = mode_};
  if (geteuid() == 0) {
    access.owner = owner_;
    access.group = group_;
  }
  return access;
}

void MappedFile::Open() {
  // A pipe without a writer would block the open.
  Descriptor file(open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!file.valid() || fstat(file.get(), &status) != 0) {
    const int error = errno;
    problem_ = path_ + ": " + std::strerror(error) + Remedy(error);
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    problem_ =
        path_ + (S_ISDIR(status.st_mode) ? " is a folder, not a file" : " is no regular file: copy it to one");
    return;
  }
  mode_ = status.st_mode & 0777U;
  owner_ = status.st_uid;
  group_ = status.st_gid;
  if (status.st_size == 0) return;
  region_ = std::make_unique<MappedRegion>(std::move(file), static_cast<std::size_t>(status.st_size));
  if (const int error = region_->error(); error != 0) {
    problem_ = path_ + ": " + std::strerror(error) + Remedy(error);
    region_.reset();
  }
}

std::string MappedFile::Loss() const {
  if (region_ == nullptr) return "";
  const std::size_t size = region_->bytes().size();
  if (const std::size_t left = region_->Left(); left < size) {
    return path_ + " was made shorter while it was read: of its " + std::to_string(size) + " bytes " +
           std::to_string(left) + " are left";
  }
  if (!region_->fell()) return "";
  return path_ + " could not be read everywhere: it was written anew meanwhile, or its disk is defective";
}

}  // namespace axlecast
