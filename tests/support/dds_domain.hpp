#pragma once
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <string>

namespace exemplar::testing {

/// A DDS domain that no other test of this machine uses meanwhile: 20 to 99, held by a file lock
/// that goes with the process. Ends the test program when all are taken.
class DdsDomain {
 public:
  DdsDomain() {
    for (int number = 20; number < 100; ++number) {
      const std::string path = "/tmp/exemplar-dds-domain-" + std::to_string(number) + ".lock";
      const int file = open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
      if (file < 0) continue;
      if (flock(file, LOCK_EX | LOCK_NB) == 0) {
        file_ = file;
        number_ = number;
        return;
      }
      close(file);
    }
    std::cerr << "no DDS domain from 20 to 99 is free\n";
    std::abort();
  }
  ~DdsDomain() { close(file_); }
  DdsDomain(const DdsDomain&) = delete;
  DdsDomain& operator=(const DdsDomain&) = delete;

  int number() const { return number_; }

 private:
  int file_ = -1;
  int number_ = 0;
};

}  // namespace exemplar::testing
