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

// The signal handler may interrupt any code: it takes no lock and allocates no memory.
struct Slot {
  std::atomic<bool> taken = false;
  std::atomic<bool> fell = false;
  std::atomic<int> file = -1;
  std::atomic<std::uintptr_t> begin = 0;
  std::atomic<std::size_t> size = 0;  // whole pages; 0: nothing is mapped
};
static_assert(std::atomic<std::uintptr_t>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

std::array<Slot, MappedFile::kMax> slots;
struct sigaction before_us {};

std::size_t PageSize() {
  static const auto kSize = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return kSize;
}

// Replaces the page at `offset` by zeros; if the file ends before it, also all pages that follow. Uses only system calls.
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
    const std::size_t offset = address - slot.begin;  // beyond every size if `address` is before `begin`
    if (info->si_code != BUS_ADRERR || offset >= slot.size) continue;
    if (!Fill(slot, offset / PageSize() * PageSize())) break;
    errno = error;
    return;
  }
  // Not of a mapped file: the former action is executed, when the instruction fails again or the signal is sent again.
  sigaction(SIGBUS, &before_us, nullptr);
  if (info->si_code <= 0) static_cast<void>(raise(SIGBUS));
}

bool TakeSignal() {
  static_cast<void>(PageSize());  // not for the first time in the handler
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
      return ": the right to read it is missing";
    case EMFILE:
      return ": use fewer files at a time, or raise `ulimit -n`";
    case ENOENT:
      return ": check its name";
    default:
      return "";
  }
}

}  // namespace

class MappedFile::Mapping {
 public:
  // Maps the first `size` bytes of the file, > 0.
  Mapping(Descriptor file, std::size_t size) : file_(std::move(file)) {
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
  ~Mapping() {
    if (slot_ == kMax) return;
    Slot& slot = slots[slot_];
    slot.size = 0;
    if (!bytes_.empty()) munmap(const_cast<std::uint8_t*>(bytes_.data()), bytes_.size());
    slot.taken = false;
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  [[nodiscard]] int error() const { return error_; }  // errno if nothing could be mapped; else 0
  [[nodiscard]] Bytes bytes() const { return bytes_; }
  // Returns how many of the bytes the file still has.
  [[nodiscard]] std::size_t Left() const {
    struct stat status {};
    if (fstat(file_.get(), &status) != 0) return bytes_.size();
    return std::min(bytes_.size(), static_cast<std::size_t>(status.st_size));
  }
  // Returns true if zeros were shown instead of bytes of the file.
  [[nodiscard]] bool fell() const { return slot_ < kMax && slots[slot_].fell; }

 private:
  Descriptor file_;
  Bytes bytes_;
  std::size_t slot_ = kMax;  // of the table that the signal handler reads
  int error_ = 0;
};

MappedFile::~MappedFile() = default;
MappedFile::MappedFile(MappedFile&&) noexcept = default;
MappedFile& MappedFile::operator=(MappedFile&&) noexcept = default;

// A pipe without a writer would block the open.
MappedFile::MappedFile(const std::string& path)
    : MappedFile(Descriptor(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)), path) {}

MappedFile::MappedFile(Descriptor file, std::string name) : path_(std::move(name)) { Map(std::move(file)); }

FileAccess MappedFile::access() const {
  FileAccess access{.mode = mode_};
  if (geteuid() == 0) {
    access.owner = owner_;
    access.group = group_;
  }
  return access;
}

void MappedFile::Map(Descriptor file) {
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
  mapping_ = std::make_unique<Mapping>(std::move(file), static_cast<std::size_t>(status.st_size));
  bytes_ = mapping_->bytes();
  if (const int error = mapping_->error(); error != 0)
    problem_ = path_ + ": " + std::strerror(error) + Remedy(error);
}

std::string MappedFile::Loss() const {
  if (bytes_.empty()) return "";
  const std::size_t size = bytes_.size();
  if (const std::size_t left = mapping_->Left(); left < size) {
    return path_ + " was made shorter while it was read: of its " + std::to_string(size) + " bytes " +
           std::to_string(left) + " are left";
  }
  if (!mapping_->fell()) return "";
  return path_ + " could not be read everywhere: it was rewritten meanwhile, or its disk is defective";
}

}  // namespace axlecast
