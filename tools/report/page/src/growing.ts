/// Rows of numbers that come one by one: the newest stay, the oldest make room.

export class Growing {
  private data: Float64Array;
  private first = 0;
  private rows = 0;

  /** Rows of `width` numbers, `most` of them at most. */
  constructor(
    readonly width: number,
    private readonly most: number,
  ) {
    this.data = new Float64Array(2 * most * width);
  }

  get length(): number {
    return this.rows;
  }

  /** Missing numbers become NaN. */
  push(row: ArrayLike<number | null>): void {
    if (this.rows === this.most) {
      ++this.first;
      --this.rows;
    }
    if (this.first + this.rows === 2 * this.most) {
      this.data.copyWithin(0, this.first * this.width, (this.first + this.rows) * this.width);
      this.first = 0;
    }
    const at = (this.first + this.rows) * this.width;
    for (let k = 0; k < this.width; ++k) this.data[at + k] = row[k] ?? Number.NaN;
    ++this.rows;
  }

  /** The rows, oldest first; valid until the next push. */
  view(): Float64Array {
    return this.data.subarray(this.first * this.width, (this.first + this.rows) * this.width);
  }
}

/** A table whose rows come one by one, all with the same titles. */
export class GrowingTable {
  readonly titles: string[];
  private readonly columns: Growing[];

  constructor(
    readonly over: string,
    first: Record<string, number | null>,
    most: number,
  ) {
    this.titles = Object.keys(first);
    this.columns = this.titles.map(() => new Growing(1, most));
    this.push(first);
  }

  /** False: the row has other titles. */
  push(row: Record<string, number | null>): boolean {
    const names = Object.keys(row);
    if (names.length !== this.titles.length || names.some((name, i) => name !== this.titles[i])) return false;
    this.columns.forEach((column, i) => column.push([row[this.titles[i]!] ?? null]));
    return true;
  }

  get length(): number {
    return this.columns[0]?.length ?? 0;
  }

  column(title: string): Float64Array {
    const i = this.titles.indexOf(title);
    return i < 0 ? new Float64Array(0) : this.columns[i]!.view();
  }
}
