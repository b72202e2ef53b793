// A sparse matrix by rows: the entries of row r are those from rows[r] to rows[r + 1].
export class Matrix {
  constructor(rows, columns, weights) {
    Object.assign(this, { rows, columns, weights });
  }

  // The column of a row with one entry, or -1.
  single(row) {
    return this.rows[row + 1] - this.rows[row] === 1 ? this.columns[this.rows[row]] : -1;
  }

  // Write the product with vectors of three numbers, at the rows `wanted`.
  times(from, to, wanted) {
    const { rows, columns, weights } = this;
    for (const row of wanted) {
      let [x, y, z] = [0, 0, 0];
      for (let k = rows[row]; k < rows[row + 1]; k++) {
        const at = 3 * columns[k];
        const weight = weights[k];
        x += weight * from[at];
        y += weight * from[at + 1];
        z += weight * from[at + 2];
      }
      to[3 * row] = x;
      to[3 * row + 1] = y;
      to[3 * row + 2] = z;
    }
  }

  // Write the product with numbers.
  timesNumbers(from, to, wanted) {
    for (const row of wanted) {
      let sum = 0;
      for (let k = this.rows[row]; k < this.rows[row + 1]; k++) sum += this.weights[k] * from[this.columns[k]];
      to[row] = sum;
    }
  }
}
