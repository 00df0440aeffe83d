#include "banded.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "exemplar/geometry/wide.hpp"

namespace exemplar::motion {
namespace {

using geometry::Four;
using geometry::Load;
using geometry::Store;

/// Columns that are taken together.
constexpr int kBlock = 4;

int RoundedUp(int count) { return (count + kBlock - 1) / kBlock * kBlock; }

/// Where entry (row, column) stands, which may lie among the zeros after a column.
template <class Number>
struct Band {
  Number* data;
  int size;  ///< a multiple of kBlock
  int half_band;
  int stride;

  Number* At(int row, int column) const {
    return data + static_cast<std::ptrdiff_t>(column) * stride + (row - column);
  }
};

/// Four rows of a block's four columns. Named, not an array, so that they stay in registers.
struct Tile {
  Four a, b, c, d;
};

template <class Number>
EXEMPLAR_INLINE void LoadTile(const Band<Number>& band, int row, int block, Tile& tile) {
  Load(band.At(row, block), tile.a);
  Load(band.At(row, block + 1), tile.b);
  Load(band.At(row, block + 2), tile.c);
  Load(band.At(row, block + 3), tile.d);
}

EXEMPLAR_INLINE void TakeOff(const double* at, const double* scale, Tile& tile) {
  Four column;
  Load(at, column);
  tile.a -= column * scale[0];
  tile.b -= column * scale[1];
  tile.c -= column * scale[2];
  tile.d -= column * scale[3];
}

/// The block's own columns from what the columns before it have left: a triangular system.
EXEMPLAR_INLINE void Finish(const Band<double>& band, int row, int block,
                            const std::array<double, kBlock>& inverse, Tile& tile) {
  const double* first = band.At(block, block);
  const double* second = band.At(block + 1, block + 1);
  const double* third = band.At(block + 2, block + 2);
  tile.a *= inverse[0];
  tile.b = (tile.b - tile.a * first[1]) * inverse[1];
  tile.c = (tile.c - tile.a * first[2] - tile.b * second[1]) * inverse[2];
  tile.d = (tile.d - tile.a * first[3] - tile.b * second[2] - tile.c * third[1]) * inverse[3];
  Store(tile.a, band.At(row, block));
  Store(tile.b, band.At(row, block + 1));
  Store(tile.c, band.At(row, block + 2));
  Store(tile.d, band.At(row, block + 3));
}

EXEMPLAR_INLINE void FactoriseFour(const Band<double>& band, int row, int block,
                                   const std::array<double, kBlock>& inverse) {
  Tile tile;
  LoadTile(band, row, block, tile);
  for (int k = std::max(0, row - band.half_band); k < block; ++k) {
    TakeOff(band.At(row, k), band.At(block, k), tile);
  }
  Finish(band, row, block, inverse, tile);
}

/// As FactoriseFour, with each number of the block's own rows used twice.
EXEMPLAR_INLINE void FactoriseEight(const Band<double>& band, int row, int block,
                                    const std::array<double, kBlock>& inverse) {
  Tile upper, lower;
  LoadTile(band, row, block, upper);
  LoadTile(band, row + kBlock, block, lower);
  for (int k = std::max(0, row - band.half_band); k < block; ++k) {
    TakeOff(band.At(row, k), band.At(block, k), upper);
    TakeOff(band.At(row + kBlock, k), band.At(block, k), lower);
  }
  Finish(band, row, block, inverse, upper);
  Finish(band, row + kBlock, block, inverse, lower);
}

/// The block's triangle on the diagonal; false when a pivot is not positive.
EXEMPLAR_INLINE bool FactoriseCorner(const Band<double>& band, int block,
                                     std::array<double, kBlock>& inverse) {
  Tile tile;
  LoadTile(band, block, block, tile);
  for (int k = std::max(0, block - band.half_band); k < block; ++k) {
    TakeOff(band.At(block, k), band.At(block, k), tile);
  }
  double rest[kBlock][kBlock];
  Store(tile.a, rest[0]);
  Store(tile.b, rest[1]);
  Store(tile.c, rest[2]);
  Store(tile.d, rest[3]);
  for (int c = 0; c < kBlock; ++c) {
    for (int row = c; row < kBlock; ++row) {
      double value = rest[c][row];
      for (int before = 0; before < c; ++before) {
        value -= *band.At(block + row, block + before) * *band.At(block + c, block + before);
      }
      if (row > c) {
        *band.At(block + row, block + c) = value * inverse[c];
        continue;
      }
      if (!(value > 0) || !std::isfinite(value)) return false;
      const double root = std::sqrt(value);
      *band.At(block + c, block + c) = root;
      inverse[c] = 1 / root;
    }
  }
  return true;
}

EXEMPLAR_INLINE bool FactoriseAll(const Band<double>& band) {
  for (int block = 0; block < band.size; block += kBlock) {
    std::array<double, kBlock> inverse = {};
    if (!FactoriseCorner(band, block, inverse)) return false;
    const int end = std::min(band.size, block + kBlock + band.half_band);
    int row = block + kBlock;
    for (; row + kBlock < end; row += 2 * kBlock) FactoriseEight(band, row, block, inverse);
    if (row < end) FactoriseFour(band, row, block, inverse);
  }
  return true;
}
bool FactoriseAllPlain(const Band<double>& band) { return FactoriseAll(band); }
EXEMPLAR_WIDE bool FactoriseAllWide(const Band<double>& band) { return FactoriseAll(band); }

EXEMPLAR_INLINE void TotalOf(const Four& value, double& total) {
  total = (value[0] + value[2]) + (value[1] + value[3]);
}

EXEMPLAR_INLINE void SolveAll(const Band<const double>& band, double* x) {
  for (int block = 0; block < band.size; block += kBlock) {
    for (int c = 0; c < kBlock; ++c) {
      const double* column = band.At(block + c, block + c);
      x[block + c] /= column[0];
      for (int row = c + 1; row < kBlock; ++row) x[block + row] -= x[block + c] * column[row - c];
    }
    const int end = std::min(band.size, block + kBlock + band.half_band);
    const double xa = x[block], xb = x[block + 1], xc = x[block + 2], xd = x[block + 3];
    for (int row = block + kBlock; row < end; row += kBlock) {
      Tile tile;
      LoadTile(band, row, block, tile);
      Four rest;
      Load(x + row, rest);
      rest -= tile.a * xa + tile.b * xb + tile.c * xc + tile.d * xd;
      Store(rest, x + row);
    }
  }
  for (int block = band.size - kBlock; block >= 0; block -= kBlock) {
    Tile sums = {};
    const int end = std::min(band.size, block + kBlock + band.half_band);
    for (int row = block + kBlock; row < end; row += kBlock) {
      Tile tile;
      LoadTile(band, row, block, tile);
      Four known;
      Load(x + row, known);
      sums.a += tile.a * known;
      sums.b += tile.b * known;
      sums.c += tile.c * known;
      sums.d += tile.d * known;
    }
    double sum[kBlock];
    TotalOf(sums.a, sum[0]);
    TotalOf(sums.b, sum[1]);
    TotalOf(sums.c, sum[2]);
    TotalOf(sums.d, sum[3]);
    for (int c = kBlock - 1; c >= 0; --c) {
      const double* column = band.At(block + c, block + c);
      double rest = x[block + c] - sum[c];
      for (int row = c + 1; row < kBlock; ++row) rest -= column[row - c] * x[block + row];
      x[block + c] = rest / column[0];
    }
  }
}
void SolveAllPlain(const Band<const double>& band, double* x) { SolveAll(band, x); }
EXEMPLAR_WIDE void SolveAllWide(const Band<const double>& band, double* x) { SolveAll(band, x); }

}  // namespace

BandedMatrix::BandedMatrix(int size, int half_band)
    : size_(size), half_band_(half_band), stride_(RoundedUp(half_band + 2 * kBlock + 1)) {
  assert(size > 0 && half_band >= 0);
  const auto columns = static_cast<std::size_t>(RoundedUp(size));
  data_.assign((columns + 1) * static_cast<std::size_t>(stride_), 0.0);
}

bool BandedMatrix::Factorise() {
  const Band<double> band = {data_.data(), RoundedUp(size_), half_band_, stride_};
  for (int i = size_; i < band.size; ++i) *band.At(i, i) = 1;
  return (geometry::HasWide() ? FactoriseAllWide : FactoriseAllPlain)(band);
}

void BandedMatrix::Solve(Eigen::Ref<Eigen::VectorXd> x) const {
  assert(x.size() == size_);
  const Band<const double> band = {data_.data(), RoundedUp(size_), half_band_, stride_};
  Eigen::VectorXd padded = Eigen::VectorXd::Zero(band.size);
  padded.head(size_) = x;
  (geometry::HasWide() ? SolveAllWide : SolveAllPlain)(band, padded.data());
  x = padded.head(size_);
}

}  // namespace exemplar::motion
